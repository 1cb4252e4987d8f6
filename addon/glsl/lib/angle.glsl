/* SPDX-License-Identifier: GPL-3.0-or-later
 * Angles, more exactly than GLSL promises its own. Needs PI. */

/* The angle from (x, y) to the x axis for y >= 0, within 2e-7. (Of `atan`, Vulkan promises no more
 * than 2e-4.) Odd minimax polynomial on [0, 1] after Hastings, Approximations for Digital Computers
 * (1955), with coefficients that were fitted anew. */
float upper_angle(float y, float x)
{
  float size = abs(x);
  float t = min(y, size) / max(max(y, size), 1e-30);
  float t_sq = t * t;
  float angle = 0.00245671885;
  angle = angle * t_sq - 0.0144013362;
  angle = angle * t_sq + 0.0397811904;
  angle = angle * t_sq - 0.0723485478;
  angle = angle * t_sq + 0.10498945;
  angle = angle * t_sq - 0.14161229;
  angle = angle * t_sq + 0.199859067;
  angle = angle * t_sq - 0.33332597;
  angle = angle * t_sq + 0.999999886;
  angle *= t;
  angle = y > size ? 0.5 * PI - angle : angle;
  return x < 0.0 ? PI - angle : angle;
}
