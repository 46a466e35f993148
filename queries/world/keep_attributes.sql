-- What was stated of a world holds for its next revision, until it is stated again.
-- Takes world_id and previous (the revision before); gives nothing.
INSERT INTO world_attribute (world_id, name, run_id, value_number, value_text, value_boolean, unit, source)
SELECT :world_id, name, run_id, value_number, value_text, value_boolean, unit, source
FROM current_world_attribute
WHERE world_id = :previous
