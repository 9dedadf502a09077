"""A box of valves on the network: an example of a device that is not pneuarm's own."""
