"""`pneuarm workspace`: the workspace as files, pictures and a scene."""
