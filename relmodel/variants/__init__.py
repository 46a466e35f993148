"""What differs between two variants of an object: parts, and features and surfaces of the parts that changed."""
