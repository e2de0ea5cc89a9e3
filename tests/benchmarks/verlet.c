/* Velocity Verlet at a fixed time step as plainly as C allows, and as fast: a rival of `exact`.

   cc -O3 -march=native -DLANES=1 verlet.c -o verlet -lm
   ./verlet N L_A DT SIGMA HALF_CYCLES BURN_IN SEED

   LANES members of an ensemble take their steps side by side (8: one of each in every lane of a
   vector). Only the sliders between the first and the last mover of all lanes take part. Events are
   seen at the end of the step in which they happen. Chain: mu_d = 0.5, mu_s = 0.6 +- SIGMA,
   tan_alpha = 0.25; L_A is l0 times the amplitude of the cycles. Printed: processor time of a
   half-cycle of one member in microseconds, the mean velocity (advance per half-cycle, of the
   centre of mass) with its standard error over the lanes, and the slips.
*/
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#ifndef LANES
#define LANES 1
#endif
#define W LANES
#define MOST (3008 * W)
#define DRAWS (1 << 20)

static int n;
static double h, sigma, friction, cosine, amplitude;
static double room[8][MOST + 4 * W] __attribute__((aligned(64)));
static double *const x = room[0] + 2 * W, *const v = room[1] + 2 * W, *const pull = room[2] + 2 * W;
static double *const rest = room[3] + 2 * W, *const moves = room[4] + 2 * W;
static double *const side = room[5] + 2 * W, *const limit = room[6] + 2 * W;
static double *const stiff = room[7] + 2 * W;
static double held[MOST], advance_of[W], load_of[W], gauss[DRAWS];
static long drawn[MOST], done[W], slips;
static uint8_t flag[MOST + 16] __attribute__((aligned(64)));
static int movers[W], low = 1 << 30, high = -1;

static double uniform(uint64_t *s) {
  *s ^= *s << 13, *s ^= *s >> 7, *s ^= *s << 17;
  return ((*s >> 11) + 0.5) * 0x1p-53;
}

static void draw(int k) {
  double excess = 0.1 + sigma * gauss[drawn[k]++ % DRAWS];
  held[k] = friction + (excess > 0 ? excess : 0) * cosine;
}

static void start(int k, double s) {
  side[k] = s, moves[k] = 1, limit[k] = 1e300;
  v[k] = -0.4999999999 * h * (pull[k] - friction * s); /* half a step before it starts */
  movers[k % W]++;
  if (k / W - 1 < low) low = k / W - 1;
  if (k / W + 1 > high) high = k / W + 1;
}

static void stop(int k) {
  side[k] = moves[k] = v[k] = 0;
  draw(k), limit[k] = held[k];
  movers[k % W]--, slips++;
  if (fabs(pull[k]) > held[k]) start(k, pull[k] > 0 ? 1 : -1);
}

static void shrink(void) {
  int first = n, last = -1;
  for (int i = low < 0 ? 0 : low; i <= high && i < n; i++)
    for (int l = 0; l < W; l++)
      if (moves[i * W + l] != 0) first = i < first ? i : first, last = i;
  low = first - 1, high = last + 1;
}

/* theta goes on until the next slider of a lane at rest starts */
static void ramp(int l) {
  int top = l, end = (n - 1) * W + l;
  for (int i = 0, k = l; i < n; i++, k += W) {
    double around = (i > 0 ? x[k - W] : 0) + (i < n - 1 ? x[k + W] : 0);
    pull[k] = rest[k] + around - stiff[k] * x[k];
  }
  for (int i = 0, k = l; i < n; i++, k += W) rest[k] = pull[k], advance_of[l] += x[k], x[k] = 0;
  for (long turn = 0;; turn++) {
    if (turn > 100000) { /* nothing moves any more */
      puts("nan nan 0 0");
      exit(0);
    }
    double way = done[l] % 2 ? -1 : 1, left = way * (way * amplitude - load_of[l]);
    double a = fmax(held[top] + way * rest[top], 0), b = fmax(held[end] - way * rest[end], 0);
    double least = fmin(fmin(a, b), left);
    load_of[l] += way * least, rest[top] -= way * least, rest[end] += way * least;
    if (least < left) {
      pull[top] = rest[top], pull[end] = rest[end];
      if (a <= b) start(top, -way);
      else start(end, way);
      return;
    }
    load_of[l] = way * amplitude, done[l]++;
  }
}

static void step(void) {
  const long from = (long)(low < 0 ? 0 : low) * W, to = (long)(high >= n ? n : high + 1) * W;
  uint8_t any = 0;
  for (long k = from; k < to; k++) {
    double p = rest[k] + x[k - W] + x[k + W] - stiff[k] * x[k], f = p - friction * side[k];
    pull[k] = p;
    flag[k - from] = (fabs(p) > limit[k]) | ((v[k] + 0.5 * h * f) * side[k] < 0);
    any |= flag[k - from];
  }
  if (any) {
    for (long word = from; word < to; word += 8) {
      uint64_t eight;
      memcpy(&eight, flag + word - from, 8);
      for (; eight; eight &= eight - 1) {
        long k = word + __builtin_ctzll(eight) / 8;
        if (k >= to) break;
        if (moves[k] != 0) stop(k);
        else start(k, pull[k] > 0 ? 1 : -1);
      }
    }
    shrink();
    for (int l = 0; l < W; l++)
      if (movers[l] == 0) ramp(l);
  }
  const long begin = (long)(low < 0 ? 0 : low) * W, last = (long)(high >= n ? n : high + 1) * W;
  for (long k = begin; k < last; k++) {
    v[k] += h * moves[k] * (pull[k] - friction * side[k]);
    x[k] += h * v[k];
  }
}

static long all_done(void) {
  long sum = 0;
  for (int l = 0; l < W; l++) sum += done[l];
  return sum;
}

static double now(void) {
  struct timespec t;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return t.tv_sec + 1e-9 * t.tv_nsec;
}

int main(int count, char **given) {
  if (count != 8) return 2;
  n = atoi(given[1]), amplitude = atof(given[2]), h = atof(given[3]), sigma = atof(given[4]);
  long half_cycles = atol(given[5]), burn_in = atol(given[6]);
  uint64_t seed = 88172645463325252u ^ (uint64_t)atol(given[7]) * 0x9E3779B97F4A7C15u;
  if (n < 2 || n > 3000) return 2;
  cosine = 1 / sqrt(1 + 0.25 * 0.25), friction = 0.5 * cosine;
  for (int k = 0; k < DRAWS; k++)
    gauss[k] = sqrt(-2 * log(uniform(&seed))) * cos(2 * M_PI * uniform(&seed));
  for (int k = 0; k < n * W; k++) {
    drawn[k] = (long)(uniform(&seed) * DRAWS), rest[k] = 0.25 * cosine;
    draw(k), limit[k] = held[k], stiff[k] = k < W || k >= (n - 1) * W ? 1 : 2;
  }
  for (int l = 0; l < W; l++) ramp(l);
  while (all_done() < burn_in * W) step();
  double before[W], begun = now();
  long from = all_done(), from_lane[W], slipped = slips;
  for (int l = 0; l < W; l++) before[l] = advance_of[l], from_lane[l] = done[l];
  while (all_done() < from + half_cycles * W) step();
  double spent = now() - begun, mean = 0, square = 0;
  for (int l = 0; l < W; l++) {
    double own = (advance_of[l] - before[l]) / n / (done[l] - from_lane[l]);
    mean += own / W, square += own * own / W;
  }
  printf("%.6g %.8g %.2g %ld\n", 1e6 * spent / (all_done() - from), mean,
         sqrt(fmax(square - mean * mean, 0) / (W > 1 ? W - 1 : 1)), slips - slipped);
  return 0;
}
