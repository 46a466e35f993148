-- Name the runs that are dead to the views that a connection asks.
-- Takes dead, the text of a list; gives nothing.
SET VARIABLE dead_runs = CAST(CAST(:dead AS TEXT) AS BIGINT[])
