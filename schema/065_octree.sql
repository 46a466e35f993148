-- Level world: an oct-tree of the placed parts of a world, where one was asked for, as tables that a query walks.

CREATE TABLE octree_cell (
    world_id BIGINT NOT NULL,
    cell INTEGER NOT NULL,
    parent INTEGER,
    x0 DOUBLE PRECISION NOT NULL,
    y0 DOUBLE PRECISION NOT NULL,
    z0 DOUBLE PRECISION NOT NULL,
    x1 DOUBLE PRECISION NOT NULL,
    y1 DOUBLE PRECISION NOT NULL,
    z1 DOUBLE PRECISION NOT NULL,
    CHECK (x0 <= x1 AND y0 <= y1 AND z0 <= z1),
    PRIMARY KEY (world_id, cell)
);
COMMENT ON TABLE octree_cell IS 'Cells of an oct-tree over occurrence_box; those that were empty when it was built are not kept. What a later revision of the world adds lies in a cell of its own beside the root.';
COMMENT ON COLUMN octree_cell.world_id IS 'the world';
COMMENT ON COLUMN octree_cell.cell IS 'ordinal of the cell, 0 for the root';
COMMENT ON COLUMN octree_cell.parent IS 'the cell that was halved along each axis; null for the root, and for cells of what was added later';
COMMENT ON COLUMN octree_cell.x0 IS 'least x of the cell in the world, mm';
COMMENT ON COLUMN octree_cell.y0 IS 'least y of the cell in the world, mm';
COMMENT ON COLUMN octree_cell.z0 IS 'least z of the cell in the world, mm';
COMMENT ON COLUMN octree_cell.x1 IS 'greatest x of the cell in the world, mm';
COMMENT ON COLUMN octree_cell.y1 IS 'greatest y of the cell in the world, mm';
COMMENT ON COLUMN octree_cell.z1 IS 'greatest z of the cell in the world, mm';

CREATE TABLE octree_entry (
    world_id BIGINT NOT NULL,
    cell INTEGER NOT NULL,
    occurrence_id BIGINT NOT NULL,
    PRIMARY KEY (world_id, cell, occurrence_id)
);
COMMENT ON TABLE octree_entry IS 'The placed parts whose world box touches a leaf of the oct-tree.';
COMMENT ON COLUMN octree_entry.world_id IS 'the world';
COMMENT ON COLUMN octree_entry.cell IS 'a leaf of octree_cell';
COMMENT ON COLUMN octree_entry.occurrence_id IS 'the placed part';

INSERT INTO sds_relation (relation, level, standing) VALUES
    ('octree_cell', 'world', 'redundant'),
    ('octree_entry', 'world', 'redundant');

INSERT INTO sds_reference (relation, reference_no, column_names, parent, parent_columns) VALUES
    ('octree_cell', 0, ARRAY['world_id'], 'world', ARRAY['id']),
    ('octree_entry', 0, ARRAY['world_id'], 'world', ARRAY['id']),
    ('octree_entry', 1, ARRAY['occurrence_id'], 'occurrence', ARRAY['id']);
