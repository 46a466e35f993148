-- Notes which columns of a relation refer to the key of which other.
-- Takes relation, reference_no, column_names, parent and parent_columns; gives nothing.
INSERT INTO sds_reference (relation, reference_no, column_names, parent, parent_columns)
VALUES (:relation, :reference_no, :column_names, :parent, :parent_columns)
