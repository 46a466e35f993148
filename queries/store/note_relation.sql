-- Notes what a relation of the store is.
-- Takes relation, level and standing; gives nothing.
INSERT INTO sds_relation (relation, level, standing) VALUES (:relation, :level, :standing)
