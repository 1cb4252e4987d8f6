/* SPDX-License-Identifier: GPL-3.0-or-later
 * Caching cameras: projection into a deep framebuffer, where its texels lie, and the visibility of a
 * point. Needs: samplers camera_table, cache_blocks and cache_depth, tolerances.glsl, and sides as
 * powers of two: a block's of texels (BLOCK_BITS), a page's (PAGE_BITS) and the table's (TABLE_BITS)
 * of blocks. */

/* A row of the camera table; see `camera_rows` in corrmap/camera_table.py. */
vec4 camera_right(int camera) { return texelFetch(camera_table, ivec2(0, camera), 0); }
vec4 camera_up(int camera) { return texelFetch(camera_table, ivec2(1, camera), 0); }
vec4 camera_forward(int camera) { return texelFetch(camera_table, ivec2(2, camera), 0); }
vec4 camera_place(int camera) { return texelFetch(camera_table, ivec2(3, camera), 0); }
vec4 camera_picture(int camera) { return texelFetch(camera_table, ivec2(4, camera), 0); }
int camera_count() { return textureSize(camera_table, 0).y; }

/* Right, up and forward components of a local vector. */
vec3 camera_axes(int camera, vec3 v)
{
  return vec3(dot(camera_right(camera).xyz, v),
              dot(camera_up(camera).xyz, v),
              dot(camera_forward(camera).xyz, v));
}

/* A local point in a camera's axes; z is the distance along the view axis. */
vec3 camera_from_local(int camera, vec3 p)
{
  return camera_axes(camera, p - camera_place(camera).xyz);
}

float half_extent(int camera)
{
  return camera_place(camera).w;
}

float picture_resolution(int camera)
{
  return camera_picture(camera).w;
}

/* (u, v) in [0, 1] inside the picture, of a point in the camera's axes with z > 0. */
vec2 picture_coordinates(int camera, vec3 q)
{
  return q.xy / (q.z * half_extent(camera)) * 0.5 + 0.5;
}

/* The places of a block of a camera's picture in the pages: x of its depth, y of its other
 * channels. Negative where they are not held, as in a block that no view would choose. */
ivec2 block_places(int camera, ivec2 block)
{
  vec4 picture = camera_picture(camera);
  int number = int(picture.x) + block.y * int(picture.y) + block.x;
  ivec2 line = ivec2(number & ((1 << TABLE_BITS) - 1), number >> TABLE_BITS);
  return ivec2(texelFetch(cache_blocks, line, 0).xy);
}

/* Where a texel of the block at `place` lies in the pages. */
ivec3 placed_texel(int place, ivec2 texel)
{
  ivec2 block = ivec2(place, place >> PAGE_BITS) & ((1 << PAGE_BITS) - 1);
  ivec2 inside = texel & ((1 << BLOCK_BITS) - 1);
  return ivec3((block << BLOCK_BITS) + inside, place >> (2 * PAGE_BITS));
}

/* Where a texel lies in the pages, of whose block the places are known; z < 0 where it is not
 * held. */
ivec3 page_texel(ivec2 places, ivec2 texel)
{
  return places.y < 0 ? ivec3(-1) : placed_texel(places.y, texel);
}

/* The four texels round a picture position, the places of their blocks, and their bilinear
 * weights. */
struct Footprint {
  ivec2 texel[4];
  ivec2 places[4];
  vec4 weight;
};

Footprint bilinear_footprint(int camera, vec2 uv)
{
  int last = int(picture_resolution(camera)) - 1;
  vec2 position = uv * picture_resolution(camera) - 0.5;
  vec2 corner = floor(position);
  vec2 f = position - corner;
  ivec2 c = ivec2(corner);
  Footprint footprint;
  footprint.texel[0] = clamp(c, ivec2(0), ivec2(last));
  footprint.texel[1] = clamp(c + ivec2(1, 0), ivec2(0), ivec2(last));
  footprint.texel[2] = clamp(c + ivec2(0, 1), ivec2(0), ivec2(last));
  footprint.texel[3] = clamp(c + ivec2(1, 1), ivec2(0), ivec2(last));
  ivec2 first = footprint.texel[0] >> BLOCK_BITS;
  ivec2 second = footprint.texel[3] >> BLOCK_BITS;
  footprint.places[0] = block_places(camera, first);
  footprint.places[1] = footprint.places[0];
  footprint.places[2] = footprint.places[0];
  footprint.places[3] = footprint.places[0];
  if (first != second) {
    footprint.places[1] = block_places(camera, ivec2(second.x, first.y));
    footprint.places[2] = block_places(camera, ivec2(first.x, second.y));
    footprint.places[3] = block_places(camera, second);
  }
  footprint.weight = vec4((1.0 - f.x) * (1.0 - f.y), f.x * (1.0 - f.y), (1.0 - f.x) * f.y, f.x * f.y);
  return footprint;
}

/* How far from the tangent plane of a point at the depth z a texel may lie that shows its surface:
 * made of the texel's own width there and of float rounding; `size` is the length of the coordinates
 * that were rounded. Candidates are left out by it, see tile_bounds.glsl. */
float same_surface_bound(int camera, float z, float size)
{
  float width = 2.0 * half_extent(camera) * z / picture_resolution(camera);
  return SAME_SURFACE_TEXELS * width + POSITION_ROUNDING * size;
}

/* How surely a texel shows the surface that has normal n at q (both in the camera's axes), from
 * 1 on its tangent plane there down to 0 at `same_surface_bound`. `place` is its block's. */
float same_surface(int camera, int place, ivec2 texel, vec3 q, vec3 n, float size)
{
  float depth = texelFetch(cache_depth, placed_texel(place, texel), 0).r;
  if (depth <= 0.0) {
    return 0.0;
  }
  float extent = half_extent(camera);
  vec2 uv = (vec2(texel) + 0.5) / picture_resolution(camera);
  vec3 seen = depth * vec3((uv * 2.0 - 1.0) * extent, 1.0);
  return max(0.0, 1.0 - abs(dot(n, seen - q)) / same_surface_bound(camera, q.z, size));
}

/* The bilinear weights, less where a texel shows something else or is not held. */
vec4 visible_weights(int camera, Footprint footprint, vec3 q, vec3 n, float size)
{
  vec4 weight = footprint.weight;
  for (int i = 0; i < 4; i++) {
    int place = footprint.places[i].x;
    weight[i] *= place < 0 ? 0.0 : same_surface(camera, place, footprint.texel[i], q, n, size);
  }
  return weight;
}
