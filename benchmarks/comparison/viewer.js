// One plan: bodies at a time that is played or set, and what is near the body under the pointer.
"use strict";

(() => {
  const { element, corners, star, between } = drawing;
  const STEPS_PER_SECOND = 2;
  const data = JSON.parse(document.getElementById("data").textContent);
  const form = document.querySelector("form").elements;
  const svg = document.querySelector("svg");
  const hover = document.getElementById("hover");
  const clock = { time: 0, playing: false, frame: null, pointed: null };

  // The largest distance from a face of the collision set, for encounters that count at this time.
  function clearances(agent, time) {
    return data.encounters
      .filter((meeting) => meeting.agents.includes(agent) && time <= meeting.end)
      .map((meeting) => {
        const [x, y] = between(meeting.displacements, time);
        const faces = meeting.normals.map(([a, b], p) => a * x + b * y - meeting.offsets[p]);
        const other = meeting.agents.find((i) => i !== agent);
        return [Math.max(...faces), other === undefined ? meeting.obstacle : data.agents[other].name];
      })
      .sort((first, second) => first[0] - second[0]);
  }

  function describe(agent, time) {
    const near = clearances(agent, time).slice(0, 3)
      .map(([distance, name]) => `${distance.toFixed(3)} to ${name}`);
    const [x, y] = between(data.agents[agent].path, time);
    hover.value = `${data.agents[agent].name}, t = ${time.toFixed(2)}, at (${x.toFixed(2)}, ${y.toFixed(2)}); `
      + (near.length ? `clearance ${near.join(", ")}` : "no clearance to keep");
  }

  function listen(node, agent, when) {
    const point = () => {
      clock.pointed = when === null ? agent : null;
      describe(agent, when === null ? clock.time : when);
    };
    for (const event of ["pointerenter", "focus"]) node.addEventListener(event, point);
    for (const event of ["pointerleave", "blur"]) {
      node.addEventListener(event, () => { clock.pointed = null; });
    }
  }

  const [left, bottom, width, height] = data.view;
  const size = Math.max(width, height) / 40;
  svg.setAttribute("viewBox", `${left} ${-bottom - height} ${width} ${height}`);
  const obstacles = data.obstacles.map((obstacle) =>
    element("polygon", { class: "obstacle", points: corners(obstacle.outline) }));
  svg.append(...obstacles);
  const bodies = data.agents.map((agent, i) => {
    svg.append(element("polyline", { class: "path", points: corners(agent.path), stroke: agent.colour }));
    svg.append(star(agent.goal, size, agent.colour));
    const outline = { class: "outline", points: corners(agent.outline), fill: agent.colour, stroke: agent.colour };
    const body = element("g", { class: "body", tabindex: 0, role: "button" }, element("polygon", outline));
    body.setAttribute("aria-label", agent.name);
    listen(body, i, null);
    return body;
  });
  svg.append(...bodies);
  data.agents.forEach((agent, i) => agent.path.forEach(([x, y], t) => {
    const dot = element("circle", { class: "dot", cx: x, cy: -y, r: size / 5, fill: agent.colour });
    listen(dot, i, t);
    svg.append(dot);
  }));

  function show() {
    const time = clock.time;
    form.time.value = time;
    document.getElementById("shown").value = `t = ${time.toFixed(2)}`;
    data.obstacles.forEach((obstacle, k) => {
      const [x, y] = between(obstacle.places, time);
      obstacles[k].setAttribute("transform", `translate(${x} ${-y})`);
      obstacles[k].style.display = obstacle.until === null || time < obstacle.until ? "" : "none";
    });
    data.agents.forEach((agent, i) => {
      const [x, y] = between(agent.path, time);
      bodies[i].setAttribute("transform", `translate(${x} ${-y})`);
      bodies[i].classList.toggle("left", agent.leaves && time >= agent.path.length - 1);
    });
    if (clock.pointed !== null) describe(clock.pointed, time);
  }

  function play(on) {
    cancelAnimationFrame(clock.frame);
    if (on && clock.time >= data.last) clock.time = 0;
    clock.playing = on;
    form.play.textContent = on ? "Pause" : "Play";
    show();
    let before = null;
    const tick = (now) => {
      clock.time = Math.min(clock.time + STEPS_PER_SECOND * (now - (before ?? now)) / 1000, data.last);
      before = now;
      show();
      if (clock.time >= data.last) play(false);
      else clock.frame = requestAnimationFrame(tick);
    };
    if (on) clock.frame = requestAnimationFrame(tick);
  }

  form.time.max = data.last;
  form.time.addEventListener("input", () => {
    clock.time = form.time.valueAsNumber;
    play(false);
  });
  form.play.addEventListener("click", () => play(!clock.playing));
  show();
})();
