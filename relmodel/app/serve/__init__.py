"""The store in a local web page: runs and objects, what lies in a box, questions with parameters."""
