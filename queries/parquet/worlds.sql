-- Every revision of some worlds.
-- Takes worlds (array of names); gives world_id, name, revision and newest (boolean), sorted by name and revision.
SELECT w.id AS world_id, w.name, w.revision, w.id = c.world_id AS newest
FROM world AS w
JOIN current_world AS c ON c.name = w.name
WHERE w.name = ANY(:worlds)
ORDER BY w.name, w.revision
