"""What a person meets: the command line, the Python surface, reports and pages, exports, and questions about runs."""
