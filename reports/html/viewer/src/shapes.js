// Faces of cells by kind, corners in VTK order.

const FACES = {
  tri: [[0, 1, 2]],
  quad: [[0, 1, 2, 3]],
  tet: [[0, 1, 3], [1, 2, 3], [2, 0, 3], [0, 2, 1]],
  pyramid: [[0, 3, 2, 1], [0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]],
  wedge: [[0, 1, 2], [3, 5, 4], [0, 3, 4, 1], [1, 4, 5, 2], [2, 5, 3, 0]],
  hex: [[0, 4, 7, 3], [1, 2, 6, 5], [0, 1, 5, 4], [3, 7, 6, 2], [0, 3, 2, 1], [4, 5, 6, 7]],
};
const CORNERS = { tri: 3, quad: 4, tet: 4, pyramid: 5, wedge: 6, hex: 8 };

// One entry an item: its loops of point indices, and its centre.
export function readItems(packed, points, indices) {
  const { header, array } = packed;
  const kinds = array("item.kind");
  const sizes = array("item.sizes");
  const nodes = indices(array("item.nodes"));
  const low = array("item.low");
  const high = array("item.high");
  const zones = array("item.zone");
  const items = [];
  let at = 0;
  let s = 0;
  const count = { cell: 0, face: 0, point: 0 };
  for (let i = 0; i < kinds.length; i++) {
    const kind = header.kinds[kinds[i]];
    const loops = [];
    let end = at;
    if (FACES[kind]) {
      for (const face of FACES[kind]) loops.push(face.map((k) => nodes[at + k]));
      end = at + CORNERS[kind];
    } else if (kind === "polygon" || kind === "face") {
      end = at + sizes[s++];
      loops.push(Array.from(nodes.subarray(at, end)));
    } else if (kind === "polyhedron") {
      for (let left = sizes[s++]; left > 0; left--) {
        const size = sizes[s++];
        loops.push(Array.from(nodes.subarray(end, end + size)));
        end += size;
      }
    } else {
      end = at + 1;
    }
    const corners = new Set(nodes.subarray(at, end));
    const centre = [0, 0, 0];
    for (const p of corners) for (let d = 0; d < 3; d++) centre[d] += points[3 * p + d] / corners.size;
    let radius = 0;
    for (const p of corners) {
      radius = Math.max(radius, Math.hypot(...centre.map((c, d) => points[3 * p + d] - c)));
    }
    const entity = kind === "face" || kind === "point" ? kind : "cell";
    items.push({
      entity, kind, loops, centre, radius, place: count[entity]++,
      id: high[i] > 0x7fffffff ? -(2 ** 32 - low[i]) : high[i] * 2 ** 32 + low[i],
      zone: entity === "cell" ? zones[i] : 0xffff,
    });
    at = end;
  }
  return items;
}
