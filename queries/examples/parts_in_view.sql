-- Which parts did the newest inspection that was not refused see at least half of, and how many pixels of each?
SELECT s.path, s.visible_pixels AS pixels, CAST(s.visible_pixels AS DOUBLE PRECISION) / s.covered_pixels AS share
FROM part_in_view AS s
WHERE s.run_id = (SELECT max(part_in_view.run_id) FROM part_in_view)
    AND s.level = 'part' AND 2 * s.visible_pixels >= s.covered_pixels AND s.covered_pixels > 0
ORDER BY pixels DESC, s.path
