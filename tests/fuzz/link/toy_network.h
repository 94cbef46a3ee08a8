/**
 * @file toy_network.h
 * A network for link_receiver.h whose answer tells every sample of its window apart, and costs nothing: a hash of
 * the last `window` samples. What it says of a sample is known without any link.
 */
#pragma once

#include "fuzz.h"
#include "link_receiver.h"

#define TOY_WINDOW 300  ///< samples, at most
#define TOY_BASE 0x01000193u

typedef struct {
  uint16_t window;
  uint16_t stride;
  uint32_t oldest;  ///< TOY_BASE to the power of the window: what the oldest sample counts
  uint32_t hash;    ///< of the window
  uint32_t seen;    ///< samples since the reset
  uint32_t steps;   ///< samples in all
  uint32_t resets;
  uint32_t past[TOY_WINDOW];  ///< hashes of the last samples
} toyNetwork_t;

static inline toyNetwork_t toyMake(uint16_t window, uint16_t stride) {
  toyNetwork_t toy = {.window = window, .stride = stride, .oldest = 1};
  for (int i = 0; i < window; i++) {
    toy.oldest *= TOY_BASE;
  }
  return toy;
}

static inline uint32_t toyHash(const uint8_t sample[EDGE_LINK_SAMPLE_BYTES]) {
  uint32_t hash = 1;
  for (int i = 0; i < EDGE_LINK_SAMPLE_BYTES; i += 4) {
    uint32_t word;
    memcpy(&word, sample + i, sizeof word);
    hash = (hash ^ word) * 0x85ebca6bu;
    hash ^= hash >> 15;
  }
  return hash;
}

static inline void toyOutput(uint32_t hash, int8_t output[EDGE_LINK_OUTPUTS]) {
  hash ^= hash >> 16;
  for (int i = 0; i < EDGE_LINK_OUTPUTS; i++) {
    output[i] = (int8_t)(hash >> 8 * i);
  }
}

static inline void toyReset(void *context) {
  toyNetwork_t *toy = context;
  memset(toy->past, 0, sizeof toy->past);
  toy->hash = 0;
  toy->seen = 0;
  toy->resets++;
}

static inline bool toyStep(void *context, const uint8_t sample[EDGE_LINK_SAMPLE_BYTES],
                           int8_t output[EDGE_LINK_OUTPUTS]) {
  toyNetwork_t *toy = context;
  uint32_t *slot = &toy->past[toy->seen % toy->window];
  const uint32_t newest = toyHash(sample);
  toy->hash = toy->hash * TOY_BASE + newest - *slot * toy->oldest;
  *slot = newest;
  const bool computes = toy->seen % toy->stride == 0;
  toy->seen++;
  toy->steps++;
  if (computes) {
    toyOutput(toy->hash, output);
  }
  return computes;
}

/** The link's view of a toy; the two must outlive the receiver. */
static inline linkNetwork_t toyAsNetwork(toyNetwork_t *toy, uint8_t algorithm, const uint8_t *digest) {
  linkNetwork_t network = {.context = toy,
                           .reset = toyReset,
                           .step = toyStep,
                           .window = toy->window,
                           .stride = toy->stride,
                           .algorithm = algorithm};
  memcpy(network.digest, digest, EDGE_LINK_DIGEST_BYTES);
  return network;
}

/**
 * What the network says of a sample without any link.
 * @param sums  sums[i]: the hash of all samples before i, each counting TOY_BASE times the one after it
 */
static inline bool toyTruth(const toyNetwork_t *toy, const uint32_t *sums, uint32_t sequence,
                            int8_t output[EDGE_LINK_OUTPUTS]) {
  if (sequence % toy->stride != 0 || sequence + 1 < toy->window) {
    return false;
  }
  toyOutput(sums[sequence + 1] - sums[sequence + 1 - toy->window] * toy->oldest, output);
  return true;
}
