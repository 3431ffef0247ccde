"""The command line: one verb a file, each a thin call of the library.

A module here whose name has no leading underscore is a verb: `tactful.cli.info` holds the function `info`.
"""
