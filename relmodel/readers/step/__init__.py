"""STEP files: the CAD kernel in a child process, the text of the file, and what follows from both."""
