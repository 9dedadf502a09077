"""Three fibre-reinforced chambers in an open finite-element solver, against the inverse kinematics.

The paper compares its inverse kinematics with Abaqus; here the solver is CalculiX (``ccx``).
``python -m tools.validation.finite_elements --out DIR`` makes the meshes, solves every case and
writes ``results.json`` beside this file; :func:`report.section` turns it into Markdown.
Inside this package: millimetres, newtons and megapascals (the solver has no units of its own).
"""
