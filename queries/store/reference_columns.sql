-- Which columns refer to the key of which relation.
-- Takes nothing; gives relation, column_names, parent and parent_columns.
SELECT relation, column_names, parent, parent_columns
FROM sds_reference
ORDER BY relation, reference_no
