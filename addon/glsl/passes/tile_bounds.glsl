/* SPDX-License-Identifier: GPL-3.0-or-later
 * Bounds what each tile of the view sees; see tile_box.glsl. A pixel of the target is a
 * tile of 1 << TILE_BITS pixels along a side. */
void main()
{
  ivec2 first = ivec2(gl_FragCoord.xy) << TILE_BITS;
  ivec2 end = min(first + (1 << TILE_BITS), textureSize(visible_position, 0));
  vec3 sum = vec3(0.0);
  vec3 normal = vec3(0.0);
  vec3 eye = vec3(0.0);
  for (int y = first.y; y < end.y; y++) {
    for (int x = first.x; x < end.x; x++) {
      vec4 position = texelFetch(visible_position, ivec2(x, y), 0);
      if (position.w != 0.0) {
        normal = texelFetch(visible_normal, ivec2(x, y), 0).xyz;
        sum += normal;
        eye = viewer.place.xyz - viewer.place.w * position.xyz;
      }
    }
  }
  /* Nothing is seen: a box that is inside out. */
  tile_axis = vec4(0.0, 0.0, 1.0, 1.0);
  tile_along = vec4(1.0, 0.0, 0.0, 0.0);
  tile_low = vec4(1.0);
  tile_high = vec4(-1.0);
  if (normal == vec3(0.0)) {
    return;
  }
  /* Opposite normals may cancel; any axis serves. */
  vec3 axis = normalize(dot(sum, sum) > 1e-6 ? sum : normal);
  vec3 along = eye - axis * dot(axis, eye);
  if (dot(along, along) <= 1e-6 * dot(eye, eye)) {
    along = abs(axis.x) < 0.6 ? vec3(1.0, 0.0, 0.0) : vec3(0.0, 1.0, 0.0);
    along -= axis * dot(axis, along);
  }
  along = normalize(along);
  vec3 across = cross(axis, along);
  float cosine = 1.0;
  vec3 low = vec3(ABOVE_SCORES);
  vec3 high = vec3(-ABOVE_SCORES);
  for (int y = first.y; y < end.y; y++) {
    for (int x = first.x; x < end.x; x++) {
      vec4 position = texelFetch(visible_position, ivec2(x, y), 0);
      if (position.w != 0.0) {
        vec3 p = vec3(dot(axis, position.xyz), dot(along, position.xyz), dot(across, position.xyz));
        low = min(low, p);
        high = max(high, p);
        cosine = min(cosine, dot(axis, texelFetch(visible_normal, ivec2(x, y), 0).xyz));
      }
    }
  }
  tile_axis = vec4(axis, max(cosine - BOUND_ROUNDING, -1.0));
  tile_along = vec4(along, 0.0);
  tile_low = vec4(low, 0.0);
  tile_high = vec4(high, 0.0);
}
