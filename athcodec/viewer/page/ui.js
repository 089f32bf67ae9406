// Small things that the page is made of: numbers as text, groups of buttons, the bar of what is ready.

export const $ = (id) => document.getElementById(id);

const UNITS = { m: 1, cm: 0.01, mm: 0.001, km: 1000, in: 0.0254, ft: 0.3048 };

/** In three figures; number and unit stay on one line. */
export function bytesText(bytes) {
  if (bytes < 1e3) return `${bytes}\u00a0B`;
  return bytes < 999500 ? `${(bytes / 1e3).toFixed(bytes < 1e4 ? 1 : 0)}\u00a0kB` : `${(bytes / 1e6).toFixed(bytes < 1e7 ? 2 : bytes < 1e8 ? 1 : 0)}\u00a0MB`;
}

export function rateText(bits) {
  return bits < 1e6 ? `${(bits / 1e3).toFixed(1)} kbit/s` : `${(bits / 1e6).toFixed(2)} Mbit/s`;
}

export const upper = (text) => text[0].toUpperCase() + text.slice(1);
export const countText = (number) => number.toLocaleString("en");

/** A length of the file, where its unit is known in millimetres, or in metres from ten on. */
export function lengthText(length, unit) {
  if (!(unit in UNITS)) return `${Number(length.toPrecision(3))}${unit ? ` ${unit}` : ""}`;
  const metres = length * UNITS[unit];
  return metres >= 10 ? `${Number(metres.toPrecision(3))} m` : `${countText(Number((1e3 * metres).toPrecision(3)))} mm`;
}

/** As `lengthText` in two figures, in the unit that it is read in best. */
export function shortLength(length, unit) {
  if (!(unit in UNITS)) return lengthText(Number(length.toPrecision(2)), unit);
  const mm = 1e3 * length * UNITS[unit], [size, name] = mm < 99.5 ? [1, "mm"] : mm < 995 ? [10, "cm"] : [1000, "m"];
  return `${countText(Number((mm / size).toPrecision(2)))}\u00a0${name}`;
}

/** A level, for people: "detail 2 of 6". */
export function detailText({ levelCount }, level) {
  return level >= levelCount - 1 ? "full detail" : `detail ${level} of ${levelCount - 1}`;
}

/** Buttons of which one is chosen, a radio group: {value, set, values}. One of them takes the focus, arrows move the choice. */
export class Choice {
  constructor(element, chosen) {
    this.element = element;
    this.chosen = chosen;
    element.addEventListener("click", ({ target }) => {
      const button = target.closest("button");
      if (button && !button.disabled) this.pick(button.dataset.value);
    });
    element.addEventListener("keydown", (event) => {
      const by = { ArrowLeft: -1, ArrowUp: -1, ArrowRight: 1, ArrowDown: 1 }[event.key];
      if (!by) return;
      event.preventDefault();
      this.next(by);
      this.buttons.find((button) => button.tabIndex === 0)?.focus();
    });
    this.mark();
  }

  get buttons() {
    return [...this.element.querySelectorAll("button")];
  }

  fill(values, labels, titles = []) {
    const text = values.map((value, i) => [value, labels[i], titles[i] ?? ""]), same = JSON.stringify(text);
    if (this.filled === same) return;
    this.filled = same;
    this.element.replaceChildren(...text.map(([, textContent, title]) => Object.assign(document.createElement("button"), { textContent, title })));
    this.buttons.forEach((button, i) => { button.dataset.value = values[i]; });
    this.mark();
  }

  mark() {
    const { buttons } = this, at = Math.max(0, buttons.findIndex((button) => button.dataset.value === this.value));
    buttons.forEach((button, i) => {
      button.setAttribute("role", "radio");
      button.setAttribute("aria-checked", String(button.dataset.value === this.value));
      button.tabIndex = i === at ? 0 : -1;
    });
  }

  set(value) {
    this.value = value;
    this.mark();
  }

  pick(value) {
    this.set(value);
    this.chosen(value);
  }

  next(by = 1) {
    const values = this.buttons.filter((button) => !button.disabled).map((button) => button.dataset.value);
    this.pick(values[(values.indexOf(this.value) + by + values.length) % values.length]);
  }
}

/** Says something for a while. */
export function note(text) {
  $("note").textContent = text;
  $("note").hidden = false;
  clearTimeout(note.timer);
  note.timer = setTimeout(() => { $("note").hidden = true; }, 5000);
}

/** Rows of text, made once and changed where they differ. */
export function rows(list, entries) {
  while (list.children.length > 2 * entries.length) list.lastChild.remove();
  entries.forEach(([name, value], i) => {
    if (!list.children[2 * i]) list.append(document.createElement("dt"), document.createElement("dd"));
    const [term, detail] = [list.children[2 * i], list.children[2 * i + 1]];
    if (term.textContent !== name) term.textContent = name;
    if (detail.textContent !== value) detail.textContent = value;
  });
}

/** Draws which parts of the clip are here: the deeper the level, the stronger. */
export function paintReady(element, levels, levelCount) {
  const stops = [];
  levels.forEach((level, i) => {
    if (i > 0 && level === levels[i - 1]) return;
    const shade = level < 0 ? "transparent" : `color-mix(in srgb, var(--accent) ${Math.round(20 + 80 * ((level + 1) / levelCount) ** 1.5)}%, transparent)`;
    let end = i;
    while (end < levels.length && levels[end] === level) end++;
    stops.push(`${shade} ${(100 * i) / levels.length}% ${(100 * end) / levels.length}%`);
  });
  const image = `linear-gradient(to right, ${stops.join(", ")})`;
  if (element.dataset.image === image) return;
  element.dataset.image = image;
  element.style.backgroundImage = image;
}
