// The explorer: animated plans of an equilibrium and of the social optimum, side by side.
//
// At time t, an agent in traffic (t < arrival) is interpolated between its means at floor(t) and
// floor(t) + 1; after its arrival it stays drawn at its last mean.
"use strict";

(() => {
  const { element, corners, star, between } = drawing;
  const STEPS_PER_SECOND = 2;
  const GRID_LINES = 8; // about this many across the picture

  const data = JSON.parse(document.getElementById("data").textContent);
  const form = document.querySelector("#explorer form").elements;
  const calm = matchMedia("(prefers-reduced-motion: reduce)");
  const sides = ["selfish", "social"].map((id) => ({ root: document.getElementById(id) }));
  const clock = { time: 0, last: 0, playing: false, frame: null };

  function fill(select, values) {
    select.replaceChildren(...values.map((value) => new Option(value, value)));
  }

  function chosenPanel() {
    return data.panels.find((panel) =>
      ["setting", "scenario", "gain"].every((name) => panel[name] === form[name].value));
  }

  // ---- pictures ----

  function grid([left, bottom, width, height], size) {
    const power = 10 ** Math.floor(Math.log10(width / GRID_LINES));
    const step = [1, 2, 5, 10].map((k) => k * power).find((spacing) => width / spacing <= GRID_LINES);
    const node = element("g", { class: "grid", "font-size": size });
    node.append(element("rect", { x: left, y: -bottom - height, width, height }));
    // Stop before a label would be cut off.
    for (let x = Math.ceil(left / step) * step; x < left + width - 4 * size; x += step) {
      node.append(element("line", { x1: x, x2: x, y1: -bottom, y2: -bottom - height }));
      node.append(element("text", { x: x + size / 4, y: -bottom - size / 4 }, `x = ${x}`));
    }
    for (let y = Math.ceil(bottom / step) * step; y < bottom + height - 2 * size; y += step) {
      node.append(element("line", { x1: left, x2: left + width, y1: -y, y2: -y }));
      node.append(element("text", { x: left + size / 4, y: -y - size / 4 }, `y = ${y}`));
    }
    return node;
  }

  function drawGame(side, panel) {
    const [left, bottom, width, height] = panel.view;
    const size = width / 32;
    const svg = side.root.querySelector("svg");
    svg.setAttribute("viewBox", `${left} ${-bottom - height} ${width} ${height}`);
    svg.replaceChildren(grid(panel.view, size));
    for (const outline of panel.obstacles) {
      svg.append(element("polygon", { class: "obstacle", points: corners(outline) }));
    }
    side.bodies = side.plan.paths.map((path, i) => {
      const colour = data.colours[i % data.colours.length];
      svg.append(element("polyline", { class: "path", points: corners(path), stroke: colour }));
      for (const [x, y] of path) {
        svg.append(element("circle", { cx: x, cy: -y, r: size / 6, fill: colour }));
      }
      svg.append(star(panel.goals[i], size, colour));
      const outline = { points: corners(panel.bodies[i]), fill: colour, stroke: colour };
      return element("g", { class: "body", "data-agent": i, "font-size": size * 1.2 },
        element("polygon", outline), element("text", {}, `${i + 1}`));
    });
    svg.append(...side.bodies);
  }

  function moveBodies(side, time) {
    if (side.plan.reason) return;
    side.plan.paths.forEach((path, i) => {
      const [x, y] = between(path, time);
      const arrival = side.plan.arrival[i];
      const body = side.bodies[i];
      body.setAttribute("transform", `translate(${x} ${-y})`);
      body.classList.toggle("left", arrival !== null && time >= arrival);
      Object.assign(body.dataset, { x, y });
    });
  }

  // ---- numbers ----

  const fixed = (value) => (value === null ? "–" : value.toFixed(2));
  const whole = (value) => (value === null ? "never" : `${value}`);
  const scientific = (value) => (value === null ? "–" : value === 0 ? "0" : value.toExponential(1));
  const mean = (values) =>
    values.includes(null) ? null : values.reduce((sum, value) => sum + value, 0) / values.length;

  function crashes([value, low, high]) {
    if (value === null) return "–";
    return value > 0 ? `${scientific(value)} [${scientific(low)}, ${scientific(high)}]` : `< ${scientific(high)}`;
  }

  // Add a row to the table: each cell has its text, and its exact value as data.
  function line(table, title, name, cells, span = 1) {
    const row = table.insertRow();
    const head = document.createElement("th");
    head.scope = "row";
    head.textContent = title;
    row.append(head);
    cells.forEach(([text, value], k) => {
      const cell = row.insertCell();
      cell.textContent = text;
      cell.colSpan = span;
      Object.assign(cell.dataset, { quantity: name, column: k, value: JSON.stringify(value) });
    });
  }

  function showNumbers(side, panel) {
    const plan = side.plan;
    const table = side.root.querySelector("table");
    const body = document.createElement("tbody");
    const head = document.createElement("thead");
    const names = panel.goals.map((_, i) => `${i + 1}`);
    const top = head.insertRow();
    for (const title of ["agent", ...names, "mean"]) {
      const cell = document.createElement("th");
      cell.scope = "col";
      cell.textContent = title;
      top.append(cell);
    }
    const each = (values, text) => values.map((value) => [text(value), value]);
    const averaged = (values, text) =>
      [...each(values, text), [fixed(mean(values)), mean(values)]];
    line(body, "arrival (steps)", "arrival", averaged(plan.arrival, whole));
    line(body, "objective (steps)", "objective", averaged(plan.objective, fixed));
    line(body, "safety lost (√2σ)", "safety", averaged(plan.safety, fixed));
    const regret = plan.regret.length ? plan.regret : names.map(() => null);
    line(body, "regret (bound)", "regret", [...each(regret, scientific), ["", null]]);
    const span = names.length + 1;
    line(body, `Pr(any ${data.event})`, "crash", [[crashes(plan.crash), plan.crash]], span);
    line(body, "union bound", "risk-bound",
      [[scientific(plan.riskBound[0]), plan.riskBound[0]]], span);
    table.replaceChildren(head, body);
  }

  // ---- control ----

  function showSide(side, panel, solution, title) {
    side.plan = panel.plans[solution][form.lam.valueAsNumber];
    const lacking = Boolean(side.plan.reason);
    const reason = side.root.querySelector(".reason");
    side.root.querySelector("h3").textContent = `${title} (${side.plan.status})`;
    reason.textContent = lacking ? `No plan: ${side.plan.reason}.` : "";
    reason.hidden = !lacking;
    const svg = side.root.querySelector("svg");
    svg.style.display = lacking ? "none" : "";
    svg.setAttribute("aria-label", `${title}: paths of ${panel.goals.length} agents`);
    side.root.querySelector("table").hidden = lacking;
    if (lacking) return 0;
    drawGame(side, panel);
    showNumbers(side, panel);
    return Math.max(...side.plan.paths.map((path) => path.length - 1));
  }

  function showTime() {
    const time = calm.matches ? Math.floor(clock.time) : clock.time;
    const text = `t = ${time.toFixed(calm.matches || !clock.playing ? 0 : 1)} of ${clock.last} steps`;
    form.time.value = Math.floor(time);
    form.time.setAttribute("aria-valuetext", text);
    form.timeShown.value = text;
    sides.forEach((side) => moveBodies(side, time));
  }

  function show() {
    const panel = chosenPanel();
    const lam = `λ = ${data.lams[form.lam.valueAsNumber]}`;
    form.lamShown.value = lam;
    form.lam.setAttribute("aria-valuetext", lam);
    const name = form.equilibrium.value;
    clock.last = Math.max(
      showSide(sides[0], panel, name, `Equilibrium: ${name}`),
      showSide(sides[1], panel, data.social, "Social optimum"));
    clock.time = Math.min(clock.time, clock.last);
    form.time.max = clock.last;
    showTime();
  }

  function play(on) {
    cancelAnimationFrame(clock.frame);
    if (on && clock.time >= clock.last) clock.time = 0;
    clock.playing = on;
    form.play.textContent = on ? "Pause" : "Play";
    if (!on) {
      showTime();
      return;
    }
    let before = null;
    const tick = (now) => {
      clock.time = Math.min(clock.time + STEPS_PER_SECOND * (now - (before ?? now)) / 1000, clock.last);
      before = now;
      if (clock.time >= clock.last) play(false);
      else {
        showTime();
        clock.frame = requestAnimationFrame(tick);
      }
    };
    clock.frame = requestAnimationFrame(tick);
  }

  for (const name of ["setting", "scenario", "gain"]) {
    fill(form[name], [...new Set(data.panels.map((panel) => panel[name]))]);
  }
  fill(form.equilibrium, data.equilibria);
  form.lam.max = data.lams.length - 1;
  for (const [name, value] of Object.entries(data.start)) {
    form[name].value = value;
    form[name].addEventListener("input", show);
  }
  form.time.addEventListener("input", () => {
    clock.time = form.time.valueAsNumber;
    play(false);
  });
  form.play.addEventListener("click", () => play(!clock.playing));
  show();
})();
