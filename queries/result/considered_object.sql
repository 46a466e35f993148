-- The loaded objects that the pictures were compared with where no world was given, what is shown first.
-- Takes run_id; gives one row a variant: what became of it, what the best pose of its join explains, and where it was
-- localised its verdict, posterior and object_from_rig as m00 .. m23.
SELECT v.name AS object, v.variant, c.state, c.score, c.verdict, c.posterior,
    c.m00, c.m01, c.m02, c.m03, c.m10, c.m11, c.m12, c.m13, c.m20, c.m21, c.m22, c.m23
FROM considered_object AS c
JOIN object_variant AS v ON v.id = c.object_variant_id
WHERE c.run_id = :run_id
ORDER BY c.rank_no
