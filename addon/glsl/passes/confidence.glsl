/* SPDX-License-Identifier: GPL-3.0-or-later
 * How far each pixel's values may be trusted, from 0 to 1; and what that is made of. Below zero where
 * nothing is seen. */

/* A step on the surface, in texels of a camera that sees the place at q. */
vec2 texel_step(int camera, vec3 q, vec3 along)
{
  vec3 dq = camera_axes(camera, along);
  float density = 0.5 * picture_resolution(camera) / half_extent(camera);
  return density / q.z * (dq.xy - q.xy / q.z * dq.z);
}

/* Texels to a pixel, in the direction in which there are fewest: the smaller singular value of the
 * map from steps in the picture, through the tangent plane, to steps in the camera's. */
float texels_per_pixel(int camera, vec3 p, vec3 q, vec3 n)
{
  vec3 o = ray_origin(gl_FragCoord.xy);
  vec3 d = ray_direction(gl_FragCoord.xy);
  float depth = dot(p - o, ray.axis.xyz);
  float facing = max(-dot(n, d), FLOAT_SPACING * length(d));
  vec3 right = ray.origin_x.xyz + depth * ray.direction_x.xyz;
  vec3 up = ray.origin_y.xyz + depth * ray.direction_y.xyz;
  right += d * (dot(n, right) / facing);
  up += d * (dot(n, up) / facing);
  vec2 a = texel_step(camera, q, right);
  vec2 b = texel_step(camera, q, up);
  float size = max(max(abs(a.x), abs(a.y)), max(abs(b.x), abs(b.y)));
  if (!(size > 0.0)) {
    return 0.0;
  }
  /* Of order one, so that no square leaves the range of floats. */
  a /= size;
  b /= size;
  float determinant = abs(a.x * b.y - a.y * b.x);
  float squares = dot(a, a) + dot(b, b);
  float most = sqrt(0.5 * (squares + sqrt(max(squares * squares - 4.0 * determinant * determinant, 0.0))));
  return size * determinant / most;
}

void main()
{
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec4 position = texelFetch(visible_position, pixel, 0);
  confidence = vec4(-1.0, 0.0, 0.0, 0.0);
  if (position.w == 0.0) {
    return;
  }
  vec4 normal = texelFetch(visible_normal, pixel, 0);
  vec4 found = texelFetch(correspondence, pixel, 0);
  confidence = vec4(0.0);
  if (normal.w <= 0.0) {
    /* As gather.glsl has it: neighbours on the surface, beside it, or the material's mean. */
    confidence.x = normal.w == -1.0 ? TRUST_NEIGHBOURS : normal.w == -2.0 ? TRUST_BESIDE : 0.0;
    return;
  }
  int camera = int(found.x);
  vec3 p = position.xyz;
  vec3 q = camera_from_local(camera, p);
  vec3 n_camera = camera_axes(camera, normal.xyz);
  Footprint footprint = bilinear_footprint(camera, found.yz);
  vec4 weight = visible_weights(camera, footprint, q, n_camera, length(p) + length(q));
  float share = min(dot(weight, vec4(1.0)), 1.0);
  float sharpness = min(texels_per_pixel(camera, p, q, normal.xyz), 1.0);
  float facing = clamp(-dot(n_camera, q) * inversesqrt(dot(q, q)), 0.0, 1.0);
  confidence = vec4(share * sharpness * sqrt(facing), share, sharpness, facing);
}
