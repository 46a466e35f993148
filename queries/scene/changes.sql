-- What changes when anything but an inspection has written to the store.
-- Takes nothing; gives run_id, the newest run that did (null of none), and writes, how many transactions did.
SELECT max(l.run_id) AS run_id, count(DISTINCT (l.run_id, l.write_no)) AS writes
FROM ledger AS l
JOIN run AS r ON r.id = l.run_id
WHERE r.kind NOT IN ('inspect', 'extract', 'stereo', 'decide')
