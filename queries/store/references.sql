-- Which tables refer to which.
-- Takes nothing; gives relation and parent, the table that it refers to.
SELECT DISTINCT relation, parent
FROM sds_reference
ORDER BY relation, parent
