// What the scripts of pages share: shapes, and places between two steps.
"use strict";

const drawing = (() => {
  function element(name, attributes = {}, ...children) {
    const node = document.createElementNS("http://www.w3.org/2000/svg", name);
    for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
    node.append(...children);
    return node;
  }

  // The second axis points down on the screen, and up in the game.
  const corners = (points) => points.map(([x, y]) => `${x},${-y}`).join(" ");

  function star([x, y], radius, colour) {
    const points = Array.from({ length: 10 }, (_, k) => {
      const reach = k % 2 ? radius / 2.5 : radius;
      return [x + reach * Math.sin(k * Math.PI / 5), y + reach * Math.cos(k * Math.PI / 5)];
    });
    return element("polygon", { class: "goal", points: corners(points), fill: colour });
  }

  // The last place holds after its step.
  function between(places, time) {
    const last = places.length - 1;
    const step = Math.min(Math.floor(time), last);
    const share = Math.min(time, last) - step;
    const next = places[Math.min(step + 1, last)];
    return places[step].map((value, axis) => value + share * (next[axis] - value));
  }

  return { element, corners, star, between };
})();
