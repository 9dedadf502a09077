"""Which mistakes in the code that safety rests on no test would notice."""
