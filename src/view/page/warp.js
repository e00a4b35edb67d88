// The warped picture, by WebGL2: the grid over the first picture, moved, carries it onto the second.

const kCarry = `#version 300 es
in vec2 place; in vec2 source; in float jacobian;
uniform vec2 size;
out vec2 from; out vec2 onto; out float grown;
void main() {
  from = source; onto = (place + 0.5) / size; grown = jacobian;
  gl_Position = vec4(2.0 * onto.x - 1.0, 1.0 - 2.0 * onto.y, 0.0, 1.0);
}`;

// mode 0: mixed, 1: wiped, 2: difference. Growth from 1/4 to 4 in blue to red; folds are magenta.
const kMix = `#version 300 es
precision highp float;
in vec2 from; in vec2 onto; in float grown;
uniform sampler2D first; uniform sampler2D second;
uniform int mode; uniform float blend; uniform bool growth; uniform bool folds; uniform bool hasFirst; uniform bool hasSecond;
out vec4 colour;
vec3 ofGrowth(float j) {
  float t = clamp(log2(max(j, 1e-3)) / 2.0, -1.0, 1.0);
  vec3 low = vec3(0.13, 0.40, 0.67), high = vec3(0.70, 0.09, 0.17), middle = vec3(0.97);
  return t < 0.0 ? mix(middle, low, -t) : mix(middle, high, t);
}
void main() {
  vec3 a = hasFirst ? texture(first, from).rgb : vec3(0.80, 0.87, 0.92);
  vec3 b = hasSecond && onto.x >= 0.0 && onto.y >= 0.0 && onto.x <= 1.0 && onto.y <= 1.0 ? texture(second, onto).rgb : vec3(0.93);
  vec3 c = mode == 0 ? mix(b, a, blend) : mode == 1 ? (onto.x < blend ? a : b) : abs(a - b);
  if (growth) c = mix(c, ofGrowth(grown), 0.6);
  if (folds && grown < 0.0) c = mix(c, vec3(0.85, 0.0, 0.75), 0.7);
  colour = vec4(c, 1.0);
}`;

const kPlain = `#version 300 es
in vec2 place; uniform vec2 size; out vec2 onto;
void main() { onto = place; gl_Position = vec4(2.0 * place.x - 1.0, 1.0 - 2.0 * place.y, 0.0, 1.0); }`;
const kSecond = `#version 300 es
precision highp float; in vec2 onto; uniform sampler2D second; uniform int mode; uniform bool hasSecond; out vec4 colour;
void main() { colour = vec4(mode == 2 ? vec3(0.0) : hasSecond ? texture(second, onto).rgb : vec3(0.93), 1.0); }`;
const kTexture = 2048; // pixels of a side, more than a panel shows

const program = (gl, vertex, fragment) => {
  const made = gl.createProgram();
  for (const [type, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(type);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    gl.attachShader(made, shader);
  }
  gl.linkProgram(made);
  return made;
};

// Places of a frame between those of the times.
export const between = (map, frames, time) => {
  const { times } = map;
  let i = 1;
  while (i < times.length - 1 && times[i] < time) ++i;
  const part = Math.min(1, Math.max(0, (time - times[i - 1]) / (times[i] - times[i - 1] || 1)));
  const [a, b] = [frames[i - 1], frames[i]], out = new Float32Array(a.length);
  for (let k = 0; k < a.length; ++k) out[k] = a[k] + part * (b[k] - a[k]);
  return out;
};

// The two triangles of each cell of the grid.
export const cellsOf = ({ columns, rows }) => {
  const cells = new Uint32Array(6 * (columns - 1) * (rows - 1));
  let at = 0;
  for (let r = 0; r + 1 < rows; ++r)
    for (let c = 0; c + 1 < columns; ++c) {
      const k = r * columns + c;
      cells.set([k, k + 1, k + columns, k + 1, k + columns + 1, k + columns], at);
      at += 6;
    }
  return cells;
};

export class WarpView {
  // Throws where the browser has no WebGL2.
  constructor(canvas) {
    const gl = canvas.getContext("webgl2", { antialias: true, preserveDrawingBuffer: true });
    if (!gl) throw new Error("this browser has no WebGL2, which draws the warped picture");
    Object.assign(this, { gl, canvas, textures: [null, null] });
    this.carry = program(gl, kCarry, kMix);
    this.plain = program(gl, kPlain, kSecond);
    this.buffers = Object.fromEntries(["place", "source", "jacobian", "cells", "square"].map(name => [name, gl.createBuffer()]));
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers.square);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array([0, 0, 1, 0, 0, 1, 1, 1]), gl.STATIC_DRAW);
  }

  async setPicture(unit, bitmap) {
    const { gl } = this;
    if (this.textures[unit]?.bitmap === bitmap) return;
    if (this.textures[unit]) gl.deleteTexture(this.textures[unit].texture);
    this.textures[unit] = null;
    if (!bitmap) return;
    const by = Math.min(1, kTexture / Math.max(bitmap.width, bitmap.height));
    const small = by < 1 ? await createImageBitmap(bitmap, {
      resizeWidth: Math.round(by * bitmap.width), resizeHeight: Math.round(by * bitmap.height), resizeQuality: "high" }) : bitmap;
    const texture = gl.createTexture();
    gl.activeTexture(gl.TEXTURE0 + unit);
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, gl.RGBA, gl.UNSIGNED_BYTE, small);
    gl.generateMipmap(gl.TEXTURE_2D);
    for (const wrap of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, wrap, gl.CLAMP_TO_EDGE);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR_MIPMAP_LINEAR);
    this.textures[unit] = { texture, bitmap };
  }

  setMap(map) {
    const { gl } = this, { columns, rows } = map;
    const source = new Float32Array(2 * columns * rows);
    for (let r = 0, k = 0; r < rows; ++r)
      for (let c = 0; c < columns; ++c) {
        source[k++] = c / (columns - 1);
        source[k++] = r / (rows - 1);
      }
    const fill = (name, kind, numbers) => {
      gl.bindBuffer(kind, this.buffers[name]);
      gl.bufferData(kind, numbers, gl.DYNAMIC_DRAW);
    };
    fill("source", gl.ARRAY_BUFFER, source);
    fill("jacobian", gl.ARRAY_BUFFER, map.jacobians);
    fill("cells", gl.ELEMENT_ARRAY_BUFFER, cellsOf(map));
    this.map = map;
  }

  attribute(from, name, buffer, size) {
    const { gl } = this, at = gl.getAttribLocation(from, name);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers[buffer]);
    gl.enableVertexAttribArray(at);
    gl.vertexAttribPointer(at, size, gl.FLOAT, false, 0, 0);
  }

  uniforms(of, { size, mode, blend, growth, folds }) {
    const { gl } = this, at = name => gl.getUniformLocation(of, name);
    gl.useProgram(of);
    gl.uniform2f(at("size"), ...size);
    gl.uniform1i(at("first"), 0);
    gl.uniform1i(at("second"), 1);
    gl.uniform1i(at("hasFirst"), this.textures[0] ? 1 : 0);
    gl.uniform1i(at("hasSecond"), this.textures[1] ? 1 : 0);
    gl.uniform1i(at("mode"), mode);
    gl.uniform1f(at("blend"), blend);
    gl.uniform1i(at("growth"), growth ? 1 : 0);
    gl.uniform1i(at("folds"), folds ? 1 : 0);
    this.textures.forEach((entry, unit) => {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, entry?.texture ?? null);
    });
  }

  // `look`: {size of the second picture, time, mode, blend, growth, folds}
  draw(look) {
    const { gl, canvas, map } = this, dense = devicePixelRatio || 1;
    canvas.width = Math.max(1, Math.round(canvas.clientWidth * dense));
    canvas.height = Math.max(1, Math.round(canvas.clientHeight * dense));
    gl.viewport(0, 0, canvas.width, canvas.height);
    this.uniforms(this.plain, look);
    this.attribute(this.plain, "place", "square", 2);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
    if (!map) return;
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers.place);
    gl.bufferData(gl.ARRAY_BUFFER, between(map, map.frames, look.time), gl.DYNAMIC_DRAW);
    this.uniforms(this.carry, look);
    this.attribute(this.carry, "place", "place", 2);
    this.attribute(this.carry, "source", "source", 2);
    this.attribute(this.carry, "jacobian", "jacobian", 1);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.buffers.cells);
    gl.drawElements(gl.TRIANGLES, 6 * (map.columns - 1) * (map.rows - 1), gl.UNSIGNED_INT, 0);
  }
}
