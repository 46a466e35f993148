-- What cameras tell of the items of a run.
-- Takes run_id; gives one row an item and camera: of an item the picture first that would tell most of it, were it as modelled.
SELECT item_no, camera FROM presence_camera WHERE run_id = :run_id ORDER BY item_no, expected_log_odds DESC, camera
