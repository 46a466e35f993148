-- The newest revision of each world.
-- takes: nothing
-- gives: one row a world, in order of its name
SELECT w.id, w.name, w.revision
FROM world AS w
WHERE w.revision = (SELECT max(x.revision) FROM world AS x WHERE x.name = w.name)
ORDER BY w.name
