"use strict";
// Ties robots, weights, activations and curves to one time. In the address, #t=12.5 begins there.

window.addEventListener("error", (event) => {
  document.documentElement.dataset.error = event.message;
});
window.addEventListener("unhandledrejection", (event) => {
  document.documentElement.dataset.error = String(event.reason);
});

const PALETTE = ["#0072B2", "#E69F00", "#009E73", "#CC79A7", "#D55E00", "#56B4E9"];

function element(tag, parent, attributes = {}, text = "") {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  made.textContent = text;
  parent.append(made);
  return made;
}

// A chart of several curves; `bands` are pairs of indices of curves with the area between filled.
function chart(place, data, onTime = null) {
  const series = [{ label: data.x_label }];
  data.curves.forEach((curve, i) => {
    const color = curve.color ? curve.color : PALETTE[i % PALETTE.length];
    series.push({
      label: curve.label,
      stroke: curve.hidden ? "transparent" : color,
      width: curve.hidden ? 0 : 1.6,
      dash: curve.dash || [],
      points: { show: Boolean(curve.points), size: 6 },
      spanGaps: true,
      value: (u, value) => (value == null ? "" : value.toFixed(2)),
    });
  });
  const bands = (data.bands || []).map(([high, low, color]) => ({
    series: [high + 1, low + 1], fill: color,
  }));
  const options = {
    width: place.clientWidth, height: data.height || 240, series, bands,
    scales: { x: { time: false } },
    axes: [
      { label: data.x_label, labelSize: 20, size: 40 },
      { label: data.y_label, labelSize: 20, size: 54 },
    ],
    cursor: { drag: { x: false, y: false } },
  };
  const plot = new uPlot(options, [data.x, ...data.curves.map((curve) => curve.y)], place);
  window.addEventListener("resize", () => {
    plot.setSize({ width: place.clientWidth, height: options.height });
  });
  if (onTime) {
    plot.over.addEventListener("click", (event) => onTime(plot.posToVal(event.offsetX, "x")));
    const marker = element("div", plot.over, {
      style: "position:absolute;top:0;bottom:0;width:1px;background:#c00;pointer-events:none",
    });
    plot.mark = (time) => { marker.style.left = `${plot.valToPos(time, "x")}px`; };
  }
  return plot;
}

// A heat map over time with a marker; a click goes to that time.
class TimeMap {
  constructor(place, words, picture, duration, onTime) {
    element("h3", place, {}, words);
    this.canvas = element("canvas", place, { class: "map" });
    this.picture = picture;
    this.duration = duration;
    this.canvas.addEventListener("click", (event) => {
      onTime((event.offsetX / this.canvas.clientWidth) * duration);
    });
  }

  mark(time) {
    const canvas = this.canvas, width = canvas.clientWidth, height = canvas.clientHeight;
    canvas.width = width;
    canvas.height = height;
    const c = canvas.getContext("2d");
    c.imageSmoothingEnabled = this.picture.width > width; // averages what is too fine to be seen
    c.drawImage(this.picture, 0, 0, width, height);
    c.fillStyle = "#c00";
    c.fillRect((time / this.duration) * width, 0, 1.5, height);
  }
}

class Player {
  constructor(place, episodes) {
    this.episodes = episodes;
    this.main = episodes[0];
    this.start = this.main.times[0];
    this.end = this.main.times[this.main.times.length - 1];
    this.followers = [];
    this.playing = false;
    this.rate = 1;
    this.controls(place);
    for (const episode of episodes) {
      const robot = new Robot(element("canvas", place, { class: "robot" }), episode);
      this.followers.push((time) => robot.draw(time));
    }
    this.inside(place);
    const wanted = /t=([\d.]+)/.exec(location.hash);
    this.seek(wanted ? Number(wanted[1]) : this.start);
    window.addEventListener("resize", () => this.seek(this.time));
  }

  controls(place) {
    const bar = element("div", place, { class: "controls" });
    this.button = element("button", bar, { type: "button", id: "play" }, "Play");
    this.button.addEventListener("click", () => this.toggle());
    const slider = { type: "range", id: "time", min: this.start, max: this.end, step: 0.01 };
    this.slider = element("input", bar, { ...slider, "aria-label": "time [s]" });
    this.slider.addEventListener("input", () => this.seek(Number(this.slider.value)));
    this.output = element("output", bar);
    const rates = element("select", bar, { "aria-label": "playing speed" });
    for (const rate of [0.25, 0.5, 1, 2, 5]) element("option", rates, { value: rate }, `${rate}x`);
    rates.value = "1";
    rates.addEventListener("change", () => { this.rate = Number(rates.value); });
    document.addEventListener("keydown", (event) => {
      if (event.target.tagName === "BUTTON" || event.target.tagName === "SELECT") return;
      if (event.key === " ") { event.preventDefault(); this.toggle(); }
    });
  }

  // Speed, activations and weights of the first episode.
  inside(place) {
    const main = this.main, seek = (time) => this.seek(time);
    element("h3", place, {}, "speed over the last second [m/s]");
    const curves = this.episodes.map((each) => ({
      label: each.name, y: main.times.map((time) => each.momentary[indexAt(each.times, time)]),
    }));
    const data = { x_label: "time [s]", y_label: "m/s", x: main.times, curves, height: 190 };
    const plot = chart(element("div", place), data, seek);
    this.followers.push((time) => plot.mark(time));
    if (main.activations) this.showActivations(place, seek);
    if (main.layers.length) this.showWeights(place, seek);
  }

  showActivations(place, seek) {
    const { activations, neurons, neuron_names: names } = this.main;
    let first = 0;
    neurons.forEach((count, layer) => {
      const from = first;
      const picture = heatMap(count, activations.shape[0], (i, k) =>
        activations.values[k * activations.row + from + i] * activations.scale);
      const words = `activations of ${layer ? names[layer] : "the inputs"}: ` +
        `${count} neurons (rows), from -1 (orange) to 1 (blue)`;
      const map = new TimeMap(place, words, picture, this.end, seek);
      map.canvas.style.height = `${Math.max(60, Math.min(200, 7 * count))}px`;
      this.followers.push((time) => map.mark(time));
      first += count;
    });
  }

  showWeights(place, seek) {
    const { layers, weight_times: times } = this.main;
    layers.forEach((layer, k) => {
      const levels = layer.levels;
      const rows = Math.min(levels.row, 300), stride = levels.row / rows;
      const picture = heatMap(rows, levels.shape[0], (i, t) =>
        levels.values[t * levels.row + Math.floor(i * stride)] * levels.scale);
      const words = `weights of layer ${k}: ${rows} of ${layer.synapses} (rows); full ` +
        `colour is ±${layer.largest.toPrecision(3)}, half colour a quarter of it`;
      const map = new TimeMap(place, words, picture, this.end, seek);
      map.canvas.style.height = "200px";
      this.followers.push((time) => map.mark(time));
    });
    element("h3", place, {}, "weights now: a row for each neuron, a column for each input");
    const box = element("div", place, { class: "matrices" });
    layers.forEach((layer, k) => {
      const [, rows, columns] = layer.levels.shape;
      if (!columns) return; // only some of the weights of a large layer are here
      const figure = element("div", box);
      const canvas = element("canvas", figure);
      const note = element("div", figure, { class: "note" });
      const side = Math.max(4, Math.min(12, Math.floor(460 / columns)));
      canvas.width = columns * side;
      canvas.height = rows * side;
      this.followers.push((time) => {
        const { values, row, scale } = layer.levels, t = indexAt(times, time);
        const matrix = heatMap(rows, columns, (i, j) => values[t * row + i * columns + j] * scale);
        const c = canvas.getContext("2d");
        c.imageSmoothingEnabled = false;
        c.drawImage(matrix, 0, 0, canvas.width, canvas.height);
        note.textContent = `layer ${k}, mean size ${layer.mean_abs[t]}`;
      });
    });
  }

  seek(time) {
    this.time = Math.min(Math.max(time, this.start), this.end);
    this.slider.value = this.time;
    this.output.textContent = `${this.time.toFixed(2)} s`;
    document.documentElement.dataset.time = this.time.toFixed(2);
    for (const follow of this.followers) follow(this.time);
  }

  toggle() {
    this.playing = !this.playing;
    this.button.textContent = this.playing ? "Pause" : "Play";
    if (!this.playing) return;
    if (this.time >= this.end) this.seek(this.start);
    let last = performance.now();
    const step = (now) => {
      if (!this.playing) return;
      this.seek(this.time + (this.rate * (now - last)) / 1000);
      last = now;
      if (this.time >= this.end) this.toggle(); else requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  }
}

async function unpackEpisode(episode) {
  for (const name of ["outlines", "actuation", "broken", "activations"]) {
    if (episode[name]) episode[name] = await unpack(episode[name]);
  }
  for (const layer of episode.layers) layer.levels = await unpack(layer.levels);
  return episode;
}

async function main() {
  const data = JSON.parse(document.getElementById("data").textContent);
  for (const [id, each] of Object.entries(data.charts || {})) {
    chart(document.getElementById(id), each);
  }
  if (data.episodes && data.episodes.length) {
    const episodes = await Promise.all(data.episodes.map(unpackEpisode));
    new Player(document.getElementById("episode"), episodes);
  }
  document.documentElement.dataset.ready = "yes";
}

main();
