-- Level object: an oct-tree of the parts of an expanded object, where one was asked for, as a table that a query walks.

CREATE TABLE octree_cell (  -- Cells of oct-trees over the boxes of object_node, one tree a body; cells that are empty are not kept.
    object_id BIGINT NOT NULL,  -- the object that is expanded
    cell INTEGER NOT NULL,  -- ordinal of the cell
    body_no INTEGER NOT NULL,  -- the body whose parts it holds
    parent INTEGER,  -- the cell that was halved along each axis; null for the root
    x0 DOUBLE PRECISION NOT NULL, y0 DOUBLE PRECISION NOT NULL, z0 DOUBLE PRECISION NOT NULL,  -- least x, y and z of the cell in the body's frame, mm
    x1 DOUBLE PRECISION NOT NULL, y1 DOUBLE PRECISION NOT NULL, z1 DOUBLE PRECISION NOT NULL,  -- greatest x, y and z of the cell in the body's frame, mm
    nodes INTEGER[] NOT NULL,  -- the parts in a leaf, node_no of object_node: those of which the cube that holds the world box however the object is
        -- turned touches the cell
    CHECK (x0 <= x1 AND y0 <= y1 AND z0 <= z1),
    PRIMARY KEY (object_id, cell)
);

INSERT INTO sds_relation (relation, level, standing) VALUES
    ('octree_cell', 'object', 'redundant');

INSERT INTO sds_reference (relation, reference_no, column_names, parent, parent_columns) VALUES
    ('octree_cell', 0, ARRAY['object_id'], 'object', ARRAY['id']);
