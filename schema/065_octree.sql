-- Level world: an oct-tree of the placed parts of a world, where one was asked for, as tables that a query walks.

CREATE TABLE octree_cell (  -- Cells of an oct-tree over occurrence_box; those that were empty when it was built are not kept. What a later revision
    -- of the world adds lies in a cell of its own beside the root.
    world_id BIGINT NOT NULL,  -- the world
    cell INTEGER NOT NULL,  -- ordinal of the cell, 0 for the root
    parent INTEGER,  -- the cell that was halved along each axis; null for the root, and for cells of what was added later
    x0 DOUBLE PRECISION NOT NULL,  -- least x of the cell in the world, mm
    y0 DOUBLE PRECISION NOT NULL,  -- least y of the cell in the world, mm
    z0 DOUBLE PRECISION NOT NULL,  -- least z of the cell in the world, mm
    x1 DOUBLE PRECISION NOT NULL,  -- greatest x of the cell in the world, mm
    y1 DOUBLE PRECISION NOT NULL,  -- greatest y of the cell in the world, mm
    z1 DOUBLE PRECISION NOT NULL,  -- greatest z of the cell in the world, mm
    CHECK (x0 <= x1 AND y0 <= y1 AND z0 <= z1),
    PRIMARY KEY (world_id, cell)
);

CREATE TABLE octree_entry (  -- The placed parts whose world box touches a leaf of the oct-tree.
    world_id BIGINT NOT NULL,  -- the world
    cell INTEGER NOT NULL,  -- a leaf of octree_cell
    occurrence_id BIGINT NOT NULL,  -- the placed part
    PRIMARY KEY (world_id, cell, occurrence_id)
);

INSERT INTO sds_relation (relation, level, standing) VALUES
    ('octree_cell', 'world', 'redundant'),
    ('octree_entry', 'world', 'redundant');

INSERT INTO sds_reference (relation, reference_no, column_names, parent, parent_columns) VALUES
    ('octree_cell', 0, ARRAY['world_id'], 'world', ARRAY['id']),
    ('octree_entry', 0, ARRAY['world_id'], 'world', ARRAY['id']),
    ('octree_entry', 1, ARRAY['occurrence_id'], 'occurrence', ARRAY['id']);
