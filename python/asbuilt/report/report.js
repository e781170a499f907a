"use strict";
// Everything on the page is there without this script. It chooses a storey, switches layers, moves the drawing and
// shows figures. Text goes in as text, never as markup.
(() => {
  const main = document.querySelector("main");
  const figures = JSON.parse(document.getElementById("data").textContent);
  const storeys = [...document.querySelectorAll("figure[data-storey]")];
  const panel = document.getElementById("figures");
  const tip = document.getElementById("tip");
  let kept = null;

  // Storeys: one at a time, all of them in print.
  const buttons = [...document.querySelectorAll("button[data-storey]")];
  function showStorey(index) {
    for (const figure of storeys) figure.hidden = figure.dataset.storey !== index;
    for (const button of buttons) button.setAttribute("aria-pressed", button.dataset.storey === index);
  }
  for (const button of buttons) button.addEventListener("click", () => showStorey(button.dataset.storey));
  if (storeys.length) showStorey(storeys[0].dataset.storey);
  const shown = () => storeys.find((figure) => !figure.hidden)?.querySelector("svg");

  // Layers and colours are classes and an attribute of the page: the style sheet does the rest.
  for (const box of document.querySelectorAll("input[data-toggle]")) {
    const apply = () => main.classList.toggle(`hide-${box.dataset.toggle}`, !box.checked);
    box.addEventListener("change", apply);
    apply(); // a browser may remember boxes over a reload
  }
  const colour = document.getElementById("colour");
  const paint = () => { main.dataset.colour = colour.value; };
  colour.addEventListener("change", paint);
  paint();

  // Figures.
  function tell(index) {
    const [title, lines] = figures[index];
    panel.querySelector("h3").textContent = title;
    panel.querySelector("p").hidden = true;
    panel.querySelector("dl").replaceChildren(...lines.flatMap(([name, value]) => {
      const pair = [document.createElement("dt"), document.createElement("dd")];
      pair[0].textContent = name;
      pair[1].textContent = value;
      return pair;
    }));
  }
  function keep(element) {
    kept?.classList.remove("chosen");
    kept = element;
    kept?.classList.add("chosen");
    if (kept) tell(kept.dataset.i);
  }
  const elementAt = (event) => event.target.closest?.(".element");

  // The view: a window on the drawing, moved and zoomed through its viewBox.
  function view(svg) {
    svg.whole ??= svg.viewBox.baseVal && ["x", "y", "width", "height"].map((key) => svg.viewBox.baseVal[key]);
    return svg.window ??= [...svg.whole];
  }
  function setView(svg, window) {
    svg.window = window;
    svg.setAttribute("viewBox", window.map((value) => value.toFixed(2)).join(" "));
  }
  function toDrawing(svg, event) {
    return new DOMPoint(event.clientX, event.clientY).matrixTransform(svg.getScreenCTM().inverse());
  }
  function zoom(svg, factor, about) {
    const [x, y, width, height] = view(svg);
    const wide = Math.min(Math.max(width * factor, svg.whole[2] / 200), svg.whole[2] * 2);
    const real = wide / width;
    const at = about ?? { x: x + width / 2, y: y + height / 2 };
    setView(svg, [at.x - (at.x - x) * real, at.y - (at.y - y) * real, wide, height * real]);
  }
  function move(svg, right, down) {
    const [x, y, width, height] = view(svg);
    setView(svg, [x + right * width, y + down * height, width, height]);
  }
  const fit = (svg) => { view(svg); setView(svg, [...svg.whole]); };
  const views = { in: (svg) => zoom(svg, 0.7), out: (svg) => zoom(svg, 1 / 0.7), fit };
  for (const button of document.querySelectorAll("button[data-view]")) {
    button.addEventListener("click", () => shown() && views[button.dataset.view](shown()));
  }
  const keys = {
    "+": views.in, "=": views.in, "-": views.out, "0": fit,
    ArrowLeft: (svg) => move(svg, -0.1, 0), ArrowRight: (svg) => move(svg, 0.1, 0),
    ArrowUp: (svg) => move(svg, 0, -0.1), ArrowDown: (svg) => move(svg, 0, 0.1),
    n: (svg) => step(svg, 1), p: (svg) => step(svg, -1), Escape: () => keep(null),
  };
  function step(svg, by) {
    const all = [...svg.querySelectorAll(".element")].filter((element) => element.getClientRects().length);
    if (all.length) keep(all[(all.indexOf(kept) + by + all.length) % all.length]);
  }

  for (const svg of document.querySelectorAll("svg.plan")) {
    let held = null, moved = false;
    svg.addEventListener("wheel", (event) => {
      event.preventDefault();
      view(svg);
      zoom(svg, Math.exp(Math.sign(event.deltaY) * 0.2), toDrawing(svg, event));
    }, { passive: false });
    svg.addEventListener("pointerdown", (event) => {
      if (event.button === 0) [held, moved] = [{ x: event.clientX, y: event.clientY, view: [...view(svg)] }, false];
    });
    svg.addEventListener("pointermove", (event) => {
      if (held) {
        const right = event.clientX - held.x, down = event.clientY - held.y;
        if (!moved && Math.hypot(right, down) < 4) return;
        if (!moved) svg.setPointerCapture(event.pointerId);
        moved = true;
        const scale = svg.getScreenCTM().a;
        setView(svg, [held.view[0] - right / scale, held.view[1] - down / scale, held.view[2], held.view[3]]);
      }
      const element = held ? null : elementAt(event);
      tip.hidden = !element;
      if (!element) return;
      const [title, lines] = figures[element.dataset.i];
      tip.textContent = [title, ...lines.slice(0, 4).map(([name, value]) => `${name}: ${value}`)].join("\n");
      tip.style.left = `${Math.min(event.clientX + 14, innerWidth - tip.offsetWidth - 4)}px`;
      tip.style.top = `${Math.min(event.clientY + 14, innerHeight - tip.offsetHeight - 4)}px`;
      if (!kept) tell(element.dataset.i);
    });
    svg.addEventListener("pointerleave", () => { tip.hidden = true; });
    for (const end of ["pointerup", "pointercancel"]) svg.addEventListener(end, () => { held = null; });
    svg.addEventListener("click", (event) => { if (!moved) keep(elementAt(event) ?? null); });
    svg.addEventListener("keydown", (event) => {
      if (!keys[event.key] || event.ctrlKey || event.metaKey || event.altKey) return;
      event.preventDefault();
      keys[event.key](svg);
    });
  }

  // A row of a schedule shows its element.
  for (const button of document.querySelectorAll("button[data-show]")) {
    button.addEventListener("click", () => {
      const element = document.querySelector(`.element[data-i="${button.dataset.show}"]`);
      showStorey(element.closest("figure").dataset.storey);
      element.closest("svg").focus();
      keep(element);
    });
  }

  // Print everything that is folded.
  addEventListener("beforeprint", () => { for (const part of document.querySelectorAll("details")) part.open = true; });
})();
