-- All revisions of all worlds.
-- Takes nothing.  Gives id, name, revision, sorted by name and revision: quicker than to ask current_world.
SELECT id, name, revision
FROM world
ORDER BY name, revision
