"""Who starts and watches whom: supervisor, recorder, viewer, repair, the stop past the network."""
