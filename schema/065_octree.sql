-- Level object: an oct-tree of the parts of an expanded object, where one was asked for, as tables that a query walks.

CREATE TABLE octree_cell (  -- Cells of oct-trees over the boxes of object_node, one tree a body; cells that are empty are not kept.
    object_id BIGINT NOT NULL,  -- the object that is expanded
    cell INTEGER NOT NULL,  -- ordinal of the cell
    body_no INTEGER NOT NULL,  -- the body whose parts it holds
    parent INTEGER,  -- the cell that was halved along each axis; null for the root
    x0 DOUBLE PRECISION NOT NULL, y0 DOUBLE PRECISION NOT NULL, z0 DOUBLE PRECISION NOT NULL,  -- least x, y and z of the cell in the body's frame, mm
    x1 DOUBLE PRECISION NOT NULL, y1 DOUBLE PRECISION NOT NULL, z1 DOUBLE PRECISION NOT NULL,  -- greatest x, y and z of the cell in the body's frame, mm
    CHECK (x0 <= x1 AND y0 <= y1 AND z0 <= z1),
    PRIMARY KEY (object_id, cell)
);

CREATE TABLE octree_entry (  -- The parts of an expanded object in the leaves of its oct-tree: those that the cube about the part touches which holds
    -- its world box however the object is turned.
    object_id BIGINT NOT NULL,  -- the object that is expanded
    cell INTEGER NOT NULL,  -- a leaf of octree_cell
    node_no INTEGER NOT NULL,  -- the part, a node of object_node
    PRIMARY KEY (object_id, cell, node_no)
);

INSERT INTO sds_relation (relation, level, standing) VALUES
    ('octree_cell', 'object', 'redundant'),
    ('octree_entry', 'object', 'redundant');

INSERT INTO sds_reference (relation, reference_no, column_names, parent, parent_columns) VALUES
    ('octree_cell', 0, ARRAY['object_id'], 'object', ARRAY['id']),
    ('octree_entry', 0, ARRAY['object_id', 'cell'], 'octree_cell', ARRAY['object_id', 'cell']);
