-- Takes :sha256, :unit_mm, :loader_version.  Gives the identity of the source that was loaded so, if there is one.
SELECT id FROM source
WHERE sha256 = :sha256 AND unit_mm = :unit_mm AND loader_version = :loader_version
