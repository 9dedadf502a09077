"""The command line: the parser, what each command calls, and the words it answers with."""
