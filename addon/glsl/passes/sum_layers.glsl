/* SPDX-License-Identifier: GPL-3.0-or-later
 * Pictures times factors, added up; `sum_of_layers` is made by addon/relight/layers/sum_pass.py. */
void main()
{
  radiance = sum_of_layers(ivec2(gl_FragCoord.xy));
}
