-- How did what was solved of each camera of a rig change over the inspections that were not refused?
SELECT rig_id, camera, name, run_id, began_at, verdict, value, difference, sigmas
FROM camera_history
WHERE verdict <> 'refused'
ORDER BY rig_id, camera, name, run_id
