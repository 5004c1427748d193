"use strict";
// Unpacks recorded episodes, and draws robots and heat maps on canvases.

const COLORS = { contracted: [199, 74, 0], rest: [252, 236, 178], expanded: [12, 88, 170] };

// The colour of a level from -1 (contracted, negative) to 1 (expanded, positive).
function levelColor(level) {
  const share = Math.min(Math.abs(level), 1);
  const end = level > 0 ? COLORS.expanded : COLORS.contracted;
  return COLORS.rest.map((channel, i) => Math.round(channel + share * (end[i] - channel)));
}

function css(rgb) {
  return `rgb(${rgb[0]},${rgb[1]},${rgb[2]})`;
}

// An array that Python packed: its numbers, and its shape.
async function unpack(packed) {
  const bytes = Uint8Array.from(atob(packed.data), (c) => c.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  const buffer = await new Response(stream).arrayBuffer();
  const values = packed.type === "int16" ? new Int16Array(buffer) : new Int8Array(buffer);
  const row = values.length / packed.shape[0];
  for (let i = row; i < values.length; i++) values[i] += values[i - row]; // wraps, as in Python
  return { values, shape: packed.shape, row, scale: packed.scale };
}

// The last index whose time is not after `time`.
function indexAt(times, time) {
  let low = 0, high = times.length - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (times[middle] <= time + 1e-6) low = middle; else high = middle - 1;
  }
  return low;
}

class Robot {
  constructor(canvas, episode) {
    this.canvas = canvas;
    this.episode = episode;
    const { values, row, scale, shape } = episode.outlines;
    this.voxels = shape[1];
    this.centers = new Float64Array(shape[0]);
    this.width = 0;
    for (let t = 0; t < shape[0]; t++) {
      let sum = 0, low = Infinity, high = -Infinity;
      for (let i = 0; i < row; i += 2) {
        const x = values[t * row + i] * scale;
        sum += x; low = Math.min(low, x); high = Math.max(high, x);
      }
      this.centers[t] = (2 * sum) / row;
      this.width = Math.max(this.width, high - low);
    }
  }

  groundHeight(x) {
    const points = this.episode.ground;
    let k = 1;
    while (k < points.length - 1 && points[k][0] < x) k++;
    const [x0, y0] = points[k - 1], [x1, y1] = points[k];
    return y0 + ((x - x0) / (x1 - x0 || 1)) * (y1 - y0);
  }

  // Where the camera looks: the mean way of half a second around.
  camera(index) {
    const from = Math.max(0, index - 8), to = Math.min(this.centers.length - 1, index + 8);
    let x = 0, y = 0;
    for (let t = from; t <= to; t++) {
      x += this.centers[t];
      y += this.groundHeight(this.centers[t]);
    }
    const n = to - from + 1;
    return [x / n, y / n];
  }

  draw(time) {
    const episode = this.episode, index = indexAt(episode.times, time);
    const ratio = window.devicePixelRatio || 1;
    const width = this.canvas.clientWidth, height = Math.round(width / 3.2);
    this.canvas.style.height = `${height}px`;
    this.canvas.width = width * ratio;
    this.canvas.height = height * ratio;
    const c = this.canvas.getContext("2d");
    c.setTransform(ratio, 0, 0, ratio, 0, 0);
    c.fillStyle = "#f7f9fb";
    c.fillRect(0, 0, width, height);
    const metre = width / Math.max(3.2 * this.width, 30);
    const [cx, cy] = this.camera(index);
    const px = (x) => width / 2 + (x - cx) * metre, py = (y) => 0.76 * height - (y - cy) * metre;
    this.drawGround(c, px, py, width, height, cx, metre);
    this.drawVoxels(c, px, py, index);
    this.drawCaption(c, index);
  }

  drawGround(c, px, py, width, height, cx, metre) {
    const half = width / 2 / metre;
    c.beginPath();
    c.moveTo(-10, height + 10);
    for (const [x, y] of this.episode.ground) c.lineTo(px(x), py(y));
    c.lineTo(width + 10, height + 10);
    c.closePath();
    c.fillStyle = "#b0a89c";
    c.fill();
    c.strokeStyle = "#544c42";
    c.stroke();
    c.fillStyle = "#2c323a";
    c.fillRect(0, height - 20, width, 20);
    c.fillStyle = "#eef2f5";
    c.textAlign = "center";
    c.font = "12px system-ui, sans-serif";
    for (let x = Math.ceil((cx - half) / 5) * 5; x < cx + half; x += 5) {
      c.fillRect(px(x), height - 20, 1, 5);
      c.fillText(`${x} m`, px(x), height - 4);
    }
  }

  drawVoxels(c, px, py, index) {
    const { outlines, actuation, broken } = this.episode;
    c.lineWidth = 1.5;
    c.lineJoin = "round";
    for (let v = 0; v < this.voxels; v++) {
      const first = index * outlines.row + 8 * v;
      c.beginPath();
      for (let k = 0; k < 4; k++) {
        const x = outlines.values[first + 2 * k], y = outlines.values[first + 2 * k + 1];
        c.lineTo(px(x * outlines.scale), py(y * outlines.scale));
      }
      c.closePath();
      const level = -actuation.values[index * actuation.row + v] * actuation.scale;
      c.fillStyle = css(levelColor(level));
      c.fill();
      c.strokeStyle = "#3a2c20";
      c.stroke();
      if (broken.values[index * broken.row + v]) this.hatch(c, px, py, first);
    }
  }

  hatch(c, px, py, first) {
    const { values, scale } = this.episode.outlines;
    const xs = [0, 2, 4, 6].map((k) => px(values[first + k] * scale));
    const ys = [1, 3, 5, 7].map((k) => py(values[first + k] * scale));
    c.save();
    c.clip(); // to the voxel, whose outline is the path still
    c.strokeStyle = "#141418";
    c.beginPath();
    const left = Math.min(...xs), right = Math.max(...xs), top = Math.min(...ys);
    const bottom = Math.max(...ys);
    for (let x = left - (bottom - top); x < right; x += 8) {
      c.moveTo(x, bottom);
      c.lineTo(x + bottom - top, top);
    }
    c.stroke();
    c.restore();
  }

  drawCaption(c, index) {
    const { episode } = this;
    const n = episode.broken.values.subarray(index * this.voxels, (index + 1) * this.voxels);
    const broken = n.reduce((sum, each) => sum + each, 0);
    const lines = [
      `${episode.name}: ${episode.momentary[index].toFixed(2)} m/s in the last second, ` +
        `${episode.speed.toFixed(2)} m/s in all`,
      episode.title + (broken ? `; damage: ${broken} of ${this.voxels} voxels broken` : ""),
    ];
    c.textAlign = "left";
    lines.forEach((line, i) => {
      c.font = i ? "12px system-ui, sans-serif" : "600 14px system-ui, sans-serif";
      c.fillStyle = "rgba(255,255,255,0.8)";
      c.fillRect(8, 6 + 21 * i, c.measureText(line).width + 10, 20);
      c.fillStyle = "#282e36";
      c.fillText(line, 13, 21 + 21 * i);
    });
  }
}

// A picture of a matrix, one pixel for each number from -1 to 1; rows from the top.
function heatMap(rows, columns, level) {
  const canvas = document.createElement("canvas");
  canvas.width = columns;
  canvas.height = rows;
  const c = canvas.getContext("2d"), image = c.createImageData(columns, rows);
  for (let i = 0; i < rows; i++) {
    for (let k = 0; k < columns; k++) {
      image.data.set([...levelColor(level(i, k)), 255], 4 * (i * columns + k));
    }
  }
  c.putImageData(image, 0, 0);
  return canvas;
}
