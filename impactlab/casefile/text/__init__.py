"""The text of a case file: limited reading, writing, safe display."""
