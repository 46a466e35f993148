-- Which of the objects that the pictures were compared with they show; then what became of each.
-- Takes run; gives sentence.
WITH considered AS (
    SELECT c.rank_no, c.score, c.state, c.verdict, c.posterior, v.name,
        concat(v.name, CASE v.variant WHEN '' THEN '' ELSE concat(' (variant ', v.variant, ')') END) AS object,
        (SELECT count(*) FROM inspection_image AS i WHERE i.run_id = c.run_id) AS cameras
    FROM considered_object AS c
    JOIN object_variant AS v ON v.id = c.object_variant_id
    WHERE c.run_id = :run
),
answer AS (
    SELECT string_agg(CASE WHEN state = 'shown' THEN object END, ' and ' ORDER BY rank_no) AS shown,
        string_agg(CASE WHEN state = 'alike' THEN object END, ' or ' ORDER BY rank_no) AS alike,
        string_agg(object, ', ' ORDER BY rank_no) AS asked, count(*) AS objects
    FROM considered
)
SELECT -1 AS rank_no,
    CASE
        WHEN shown IS NULL THEN concat('the pictures show none of these surely: ', asked)
        WHEN alike IS NULL THEN concat('the pictures show ', shown)
        ELSE concat('the pictures show ', shown, ' or ', alike, ', which they do not tell apart')
    END AS sentence
FROM answer
WHERE objects > 0
UNION ALL
SELECT rank_no,
    concat(object, ': ',
        CASE
            WHEN score IS NULL THEN 'no edges of it lie to each other as those that the pictures show'
            WHEN cameras > 1
                THEN concat('the best pose of its join explains ', CAST(100 * score AS NUMERIC(18, 0)),
                    ' percent of what stereo puts in space')
            ELSE concat('the best pose of its join explains the ellipses with log odds of ', CAST(score AS NUMERIC(18, 0)))
        END,
        CASE WHEN verdict IS NULL THEN '' ELSE concat('; its pose is ', verdict, ', right with a probability of ',
            CAST(100 * posterior AS NUMERIC(18, 1)), ' percent') END,
        CASE state
            WHEN 'alike' THEN '; it explains the same edges about as well'
            WHEN 'outdone' THEN '; it explains the same edges less well'
            WHEN 'left' THEN CASE WHEN score IS NULL THEN '' ELSE '; it was not followed' END
            ELSE ''
        END) AS sentence
FROM considered
ORDER BY rank_no
