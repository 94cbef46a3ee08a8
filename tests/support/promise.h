// What test programs share: a promise that ends the program when it is broken, and bytes from a fixed generator.
#pragma once

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

static uint32_t noise = 1;

static void check(bool good, const char *what) {
  if (!good) {
    fprintf(stderr, "broken promise: %s\n", what);
    abort();
  }
}

static uint8_t random8(void) {
  noise = noise * 1664525u + 1013904223u;
  return (uint8_t)(noise >> 24);
}
