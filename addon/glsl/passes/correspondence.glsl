/* SPDX-License-Identifier: GPL-3.0-or-later
 * The best caching camera for each pixel (Kim, Kyung, Lee 2009, equation 5):
 *
 *   k = argmax_i  v_i(p) (n(p) . u_i) / d_i^2
 *
 * extended by the density of texels, so that cameras of different resolution and field of view
 * compare: (resolution / (2 tan(fov / 2)))^2 texels see a unit solid angle on the axis. */
void main()
{
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec4 position = texelFetch(visible_position, pixel, 0);
  correspondence = vec4(-1.0, 0.0, 0.0, 0.0);
  if (position.w == 0.0) {
    return;
  }
  vec3 p = position.xyz;
  vec3 n = texelFetch(visible_normal, pixel, 0).xyz;
  float best = 0.0;
  for (int camera = 0; camera < camera_count(); camera++) {
    vec3 q = camera_from_local(camera, p);
    float extent = half_extent(camera);
    if (q.z <= 0.0 || max(abs(q.x), abs(q.y)) > q.z * extent) {
      continue;
    }
    vec3 n_camera = camera_axes(camera, n);
    float distance_squared = dot(q, q);
    float facing = -dot(n_camera, q) * inversesqrt(distance_squared);
    float density = 0.5 * picture_resolution(camera) / extent;
    float score = facing * density * density / distance_squared;
    if (!(score > best)) {
      continue;
    }
    vec2 uv = picture_coordinates(camera, q);
    float size = length(p) + sqrt(distance_squared);
    vec4 weight = visible_weights(camera, bilinear_footprint(camera, uv), q, n_camera, size);
    float share = dot(weight, vec4(1.0));
    /* A camera that sees only part of the footprint loses to one that sees it all. */
    score *= share;
    if (share < VISIBLE_SHARE || !(score > best)) {
      continue;
    }
    best = score;
    correspondence = vec4(float(camera), uv, score);
  }
}
