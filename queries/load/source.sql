-- Identity of a source that was loaded so before.
-- Takes sha256, unit_mm and loader_version; gives no row or one.
SELECT id FROM source
WHERE sha256 = :sha256 AND unit_mm = :unit_mm AND loader_version = :loader_version
