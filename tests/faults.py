"""Faults of the small files of `fuzz_bases.py`, and the words in which each is to be refused."""

TRILLION = "1000000000000"
RANGE = "a range of {} with numbers below.*"
TO = f"1 to {TRILLION}"

# (reader, file): what stands in the file, what it becomes; place, expected and found of the refusal.
FAULTS = {
    ("fluent", "solid.msh"): (
        ("(10 (0 1 c 0 3))", "(10 (0 1 d 0 3))", "line 3", "as many nodes as the zones bring, 12", "13"),
        ("(12 (0 1 4 0))", "(12 (0 1 5 0))", "line 4", "as many cells as the zones bring, 4", "5"),
        ("(13 (0 1 11 0))", "(13 (0 1 10 0))", "line 5", "as many faces as the zones bring, 17", "16"),
        ("(10 (1 1 c 1 3)", "(10 (1 1 e8d4a51000 1 3)", "line 6", RANGE.format("nodes"), TO),
        ("(12 (2 1 4 1 0)", "(12 (2 1 e8d4a51000 1 0)", "line 20", RANGE.format("cells"), TO),
        ("(13 (3 1 3 2 0)", "(13 (3 1 e8d4a51000 2 0)", "line 23", RANGE.format("faces"), TO),
        ("(10 (1 1 c 1 3)", "(10 (1 1 7fffff0 1 3)", "line 6", "a count of coordinates that fits.*", "402653136"),
        ("4 8 7 6 5 1 2", "4 0 7 6 5 1 2", "line 24", r"a node of 1 to 12 \(face 1\)", "'0.*"),
        ("4 8 7 6 5 1 2", "4 d 7 6 5 1 2", "line 24", r"a node of 1 to 12 \(face 1\)", "'d.*"),
        ("4 8 7 6 5 1 2", "4 8 7 6 5 1 5", "line 24", "a cell of 1 to 4.*", "'5.*"),
        ("1.25000 0.31250 0.62500", "1.25000 nan 0.62500", "line 12", r"a finite number \(coordinates\)", "'nan.*"),
    ),
    ("gmsh", "text22.msh"): (
        ("$Nodes\n12\n", "$Nodes\n13\n", r"line 2\d", "more records.*", ".*"),
        ("$Nodes\n12\n", "$Nodes\n11\n", r"line 2\d", r"\$EndNodes.*", "'12 .*"),
        ("$Nodes\n12\n", f"$Nodes\n{TRILLION}\n", r"line \d+", "a count of nodes that fits.*", TRILLION),
        ("$Elements\n18\n", f"$Elements\n{TRILLION}\n", r"line \d+", "a count of elements that fits.*", TRILLION),
        ("4 2 7 1 6 10 7 12", "4 2 7 1 6 10 7 0", "element 18", r"a node listed in \$Nodes", "node 0"),
        ("4 2 7 1 6 10 7 12", "4 2 7 1 6 10 7 13", "element 18", r"a node listed in \$Nodes", "node 13"),
        ("\n2 1.25000 ", "\n2 nan ", "line 12", "a finite coordinate", "'nan.*"),
    ),
    ("gmsh", "text41.msh"): (
        ("1 12 1 12", f"1 {TRILLION} 1 12", "line .*", "a count of nodes that fits.*", TRILLION),
        ("1 12 1 12", "1 12 1 11", "line .*", "node numbers from 1 to 11.*", "12"),
        ("\n18 6 10 7 12", "\n18 6 10 7 0", "element 18", r"a node listed in \$Nodes", "node 0"),
        ("\n18 6 10 7 12", "\n18 6 10 7 13", "element 18", r"a node listed in \$Nodes", "node 13"),
        ("\n1.59375 ", "\nnan ", "line .*", "a finite .*", "'nan.*"),
    ),
    ("openfoam", "points"): (
        ("\n27\n", "\n28\n", r"line \d+", ".*entry 28|.*entry 27 of 28.*", ".*"),
        ("\n27\n", f"\n{TRILLION}\n", r"line \d+", "a count of .* that fits.*", TRILLION),
        ("(1.5 ", "(nan ", r"line \d+", "point .* of finite numbers.*", "'nan.*"),
    ),
    ("openfoam", "faces"): (
        ("\n36\n", f"\n{TRILLION}\n", r"line \d+", "a count of .* that fits.*", TRILLION),
        ("\n4(1 4", "\n4(-1 4", r"line \d+", "a point of a face from 0 to 26.*", "'-1.*"),
        ("\n4(1 4", "\n4(27 4", r"line \d+", "a point of a face from 0 to 26.*", "'27.*"),
    ),
    ("openfoam", "owner"): (
        ("\n36\n", f"\n{TRILLION}\n", r"line \d+", "a count of .*", TRILLION),
    ),
    ("openfoam", "boundary"): (
        ("nFaces 4;", f"nFaces {TRILLION};", r"line \d+", "nFaces of patch 'inlet' from 0 to 36", TRILLION),
    ),
}  # fmt: skip
