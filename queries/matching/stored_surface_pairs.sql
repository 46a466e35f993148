-- Pairs of regions of a picture and surfaces of a view that were considered in a run.
-- Takes run_id, view_no; gives region, view_surface, reason, pixels, region_share, surface_share.
SELECT region_no AS region, view_surface_no AS view_surface, reason,
    pixels, region_share, surface_share
FROM surface_match
WHERE run_id = :run_id AND view_no = :view_no
ORDER BY region_no, view_surface_no
