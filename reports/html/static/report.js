"use strict";
(async () => {
  const $ = (id) => document.getElementById(id);
  const packed = (id) => $(id).textContent;
  const say = (text) => { $("view-said").textContent = text; };

  async function inflate(base64) {
    const bytes = Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
    return new Response(stream).text();
  }

  // ---------------------------------------------------------------------------------------------------- light and dark
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const theme = () => document.documentElement.dataset.theme || (dark.matches ? "dark" : "light");
  let view = null;
  const button = $("theme");
  button.hidden = false;
  function showTheme() {
    button.textContent = theme() === "dark" ? "Light page" : "Dark page";
    if (view) view.setTheme(theme());
  }
  button.addEventListener("click", () => { document.documentElement.dataset.theme = theme() === "dark" ? "light" : "dark"; showTheme(); });
  dark.addEventListener("change", showTheme);
  showTheme();

  if (typeof DecompressionStream === "undefined") {
    say("This browser is too old for the 3-D view; the picture shows the worst cells.");
    document.documentElement.dataset.ready = "picture";
    return;
  }
  const panels = JSON.parse(await inflate(packed("mw-panels")));
  const size = (n) => n.toLocaleString("en");

  // ------------------------------------------------------------------------------------------------------- the metric
  let bar = null;
  const current = () => $("metric").value;
  function dressPanel() {
    const panel = $("panel").firstElementChild;
    if (!panel) return;
    for (const g of panel.querySelectorAll("svg .bar")) {
      if (panel.dataset.clickable !== "1" || !view) continue;
      g.setAttribute("tabindex", "0");
      g.setAttribute("role", "button");
      g.setAttribute("aria-pressed", "false");
    }
    $("copy").hidden = !panel.querySelector("tr[data-go]");
    writeSelection();
  }
  function showPanel(id) {
    $("panel").innerHTML = panels[id];
    const option = $("metric").selectedOptions[0];
    $("metric-name").textContent = option ? option.textContent.replace(/ \([^(]*\)$/, "") : id;
    bar = null;
    dressPanel();
  }
  function chooseMetric(id) {
    if (!(id in panels)) return;
    $("metric").value = id;
    showPanel(id);
    if (view) { view.setMetric(id); afterChange(); }
    for (const chip of $("chips").children) chip.setAttribute("aria-pressed", String(chip.dataset.metric === id));
  }
  for (const option of $("metric").querySelectorAll("optgroup:first-child option")) {
    const chip = document.createElement("button");
    chip.type = "button";
    chip.dataset.metric = option.value;
    chip.textContent = option.textContent.replace(/ \([^(]*\)$/, "");
    chip.setAttribute("aria-pressed", String(option.selected));
    $("chips").append(chip);
  }
  function chooseBar(g) {
    const k = Number(g.dataset.bar);
    bar = bar === k ? null : k;
    for (const other of $("panel").querySelectorAll("svg .bar")) other.setAttribute("aria-pressed", String(Number(other.dataset.bar) === bar));
    view.setFilter({ bar });
    afterChange();
    const shown = view.shown().cells;
    $("panel").querySelector(".bar-said").textContent = bar === null ? "" : `Showing ${size(shown)} of ${g.getAttribute("aria-label")}.`;
    if (bar !== null && shown) view.fitAll();
  }

  // --------------------------------------------------------------------------------------------------------- the view
  function afterChange() {
    const { cells, of } = view.shown();
    const what = $("panel").firstElementChild?.dataset.entity ?? "cell";
    const which = bar !== null ? "of the chosen bar" : $("everything").getAttribute("aria-pressed") === "true" ? "good and bad" : "on the bad half of the scale, or the worst there are";
    say(`Showing ${size(cells)} of ${size(of)} ${what}s in this file: ${which}.`);
    const legend = view.legend();
    $("legend").replaceChildren(...legend.labels.map((label, k) => {
      const entry = document.createElement("span");
      const patch = document.createElement("i");
      patch.style.background = legend.colours[k];
      entry.append(patch, legend.mirrored ? `${label} | ${legend.mirrored[k]}` : label);
      return entry;
    }));
  }
  function card(picked) {
    const box = $("pick");
    box.hidden = !picked;
    if (!picked) return;
    const list = document.createElement("dl");
    const row = (name, value) => {
      const dt = document.createElement("dt");
      const dd = document.createElement("dd");
      dt.textContent = name;
      dd.textContent = value;
      list.append(dt, dd);
    };
    row(picked.entity, String(picked.id));
    row("type", picked.type);
    if (picked.entity === "cell") row("zone", picked.zone === null ? "(no zone)" : picked.zone.slice(0, 300));
    row("centroid", picked.centroid.map((x) => Number(x.toPrecision(6))).join(", "));
    const legend = view.legend();
    const exact = $("panel").querySelector(`tr[data-go="${picked.entity}"][data-id="${picked.id}"] td:nth-child(4)`)?.textContent;
    const value = exact ?? (picked.value === null ? null : `about ${Number(picked.value.toPrecision(3))}`);
    if (picked.undefined) row("value", "undefined");
    else if (picked.bin === null) row("value", "this metric is not defined here");
    else row("value", `${value ? `${value}, ` : ""}in ${legend.labels[picked.bin]}${legend.mirrored ? ` | ${legend.mirrored[picked.bin]}` : ""}`);
    const copy = document.createElement("button");
    copy.type = "button";
    copy.textContent = "Copy number";
    copy.addEventListener("click", () => write(String(picked.id)));
    const close = document.createElement("button");
    close.type = "button";
    close.textContent = "Close";
    close.addEventListener("click", () => view.choose(null));
    const buttons = document.createElement("div");
    buttons.className = "copy";
    buttons.append(copy, close);
    box.replaceChildren(list, buttons);
  }
  function goTo(entity, id) {
    if (!view) return;
    if (view.goTo({ entity, id: Number(id) })) $("view-box").scrollIntoView({ block: "nearest" });
    else say(`${entity} ${id} is not among those that this file can show.`);
  }

  // --------------------------------------------------------------------------------------------------- the selections
  const selections = {
    ids: (ids) => ids.join(" "),
    paraview: (ids) => ids.map((id) => `(cell == ${id})`).join(" | "),
    hypermesh: (ids) => `*createmark elems 1 ${ids.join(" ")}`,
    openfoam: (ids) => `actions\n(\n    {\n        name    bad;\n        type    cellSet;\n        action  new;\n        source  labelToCell;\n        value   (${ids.join(" ")});\n    }\n);`,
    abaqus: (ids) => `*ELSET, ELSET=BAD\n${rows(ids, 16, ", ").join(",\n")}`,
    nastran: (ids) => `SET 1 = ${rows(ids, 7, ",").join(",\n        ")}`,
  };
  function rows(ids, n, glue) {
    const out = [];
    for (let k = 0; k < ids.length; k += n) out.push(ids.slice(k, k + n).join(glue));
    return out;
  }
  function writeSelection() {
    const ids = [...$("panel").querySelectorAll("table.worst tr[data-go]")].map((tr) => Number(tr.dataset.id)).filter(Number.isFinite);
    $("copy-text").textContent = ids.length ? selections[$("copy-as").value](ids) : "";
  }
  async function write(text) {
    try {
      await navigator.clipboard.writeText(text);
      $("copied").textContent = "copied";
    } catch {
      const range = document.createRange();
      range.selectNodeContents($("copy-text"));
      getSelection().removeAllRanges();
      getSelection().addRange(range);
      $("copied").textContent = document.execCommand("copy") ? "copied" : "press Ctrl+C";
    }
  }

  // ------------------------------------------------------------------------------------------------------------ events
  let closed = [];
  addEventListener("beforeprint", () => {
    closed = [...document.querySelectorAll("details:not([open])")];
    for (const details of closed) details.open = true;
  });
  addEventListener("afterprint", () => { for (const details of closed) details.open = false; });
  $("copy-as").addEventListener("change", writeSelection);
  $("copy-now").addEventListener("click", () => write($("copy-text").textContent));
  $("metric").addEventListener("change", () => chooseMetric(current()));
  document.addEventListener("click", (event) => {
    const target = event.target instanceof Element ? event.target : null;
    const metric = target?.closest("[data-metric]:not(.panel)");
    const going = target?.closest("[data-go]");
    const g = target?.closest("svg .bar[role=button]");
    if (target?.closest("a.cite")) $("sources").open = true;
    if (g) chooseBar(g);
    else if (going) goTo(going.dataset.go, going.dataset.id);
    else if (metric) { chooseMetric(metric.dataset.metric); $("h-metric").scrollIntoView({ block: "nearest" }); }
  });
  document.addEventListener("keydown", (event) => {
    const g = event.target instanceof Element ? event.target.closest("svg .bar[role=button]") : null;
    if (g && (event.key === "Enter" || event.key === " ")) { event.preventDefault(); chooseBar(g); }
  });

  try {
    const script = document.createElement("script");
    script.textContent = await inflate(packed("mw-viewer"));
    document.head.append(script);
    script.remove();
    const box = $("view-box");
    const picture = box.firstElementChild;
    try {
      view = await MeshwrightViewer.create(box, packed("mw-view"), { theme: theme(), metric: current() });
    } catch (error) {
      box.replaceChildren(picture);
      throw error;
    }
    picture.remove();
    $("view-controls").hidden = false;
    view.onPick(card);
    $("zone").addEventListener("change", () => {
      const [entity, index] = $("zone").value.split(" ");
      view.setFilter({ zone: entity ? { entity, index: Number(index) } : null });
      afterChange();
    });
    $("type").addEventListener("change", () => { view.setFilter({ type: $("type").value || null }); afterChange(); });
    const clip = () => {
      $("clip-at").disabled = !$("clip").value;
      view.setClip($("clip").value || null, Number($("clip-at").value) / 1000);
    };
    $("clip").addEventListener("change", clip);
    $("clip-at").addEventListener("input", clip);
    $("fit-all").addEventListener("click", () => view.fitAll());
    $("fit-worst").addEventListener("click", () => view.fitWorst());
    $("everything").addEventListener("click", () => {
      const on = $("everything").getAttribute("aria-pressed") !== "true";
      $("everything").setAttribute("aria-pressed", String(on));
      view.showEverything(on);
      afterChange();
    });
    let shot = null;
    addEventListener("beforeprint", () => {
      shot = new Image();
      shot.src = view.snapshot();
      shot.alt = "The view as it stood when the page was printed";
      box.append(shot);
      view.canvas.style.display = "none";
    });
    addEventListener("afterprint", () => { shot?.remove(); view.canvas.style.display = ""; });
    afterChange();
    dressPanel();
    globalThis.meshwrightView = view;
    document.documentElement.dataset.ready = "view";
  } catch (error) {
    $("view-controls").hidden = true;
    say(`No 3-D view: ${error.message}. The picture shows the worst cells.`);
    document.documentElement.dataset.ready = "picture";
    dressPanel();
  }
  performance.mark("meshwright-ready");
})();
