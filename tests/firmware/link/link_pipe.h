// A pipe of bytes whose faults a script orders: packets that are lost, doubled, cut, damaged, late or made up.
#pragma once

#include <stdint.h>
#include <string.h>

#include "edge_link.h"
#include "promise.h"

#define QUEUE 64
#define ROOM 160  // of a packet on the pipe: faults may lengthen it

typedef struct {
  uint8_t bytes[ROOM];
  uint16_t length;
  int due;  // step at which it arrives
} flight_t;

typedef struct {
  flight_t packets[QUEUE];
  int count;
} pipe_t;

typedef struct {
  const uint8_t *at;
  size_t left;
} script_t;

static uint8_t next(script_t *script) {
  if (script->left == 0) {
    return 0;
  }
  script->left--;
  return *script->at++;
}

static void push(pipe_t *pipe, const uint8_t *bytes, uint16_t length, int due) {
  if (pipe->count < QUEUE) {
    flight_t *packet = &pipe->packets[pipe->count++];
    memcpy(packet->bytes, bytes, length);
    packet->length = length;
    packet->due = due;
  }
}

// Puts a packet on the pipe, with the fault that the script orders.
static void transmit(pipe_t *pipe, const uint8_t *packet, uint16_t length, int step, script_t *script) {
  uint8_t bytes[ROOM];
  memcpy(bytes, packet, length);
  switch (next(script) % 16) {
    case 6:
    case 7: return;
    case 8:
      push(pipe, bytes, length, step);
      push(pipe, bytes, length, step + next(script) % 50);
      return;
    case 9: push(pipe, bytes, (uint16_t)(next(script) % (length + 1)), step); return;
    case 10:
      bytes[next(script) % length] ^= (uint8_t)(1 + next(script) % 255);
      push(pipe, bytes, length, step);
      return;
    case 11:
      for (int i = 0; i < ROOM; i++) {
        bytes[i] = random8();
      }
      push(pipe, bytes, (uint16_t)(next(script) % ROOM), step);
      return;
    case 12: push(pipe, bytes, length, step + next(script) % 50); return;
    case 13: {
      const uint16_t longer = (uint16_t)(length + next(script) % (ROOM - EDGE_LINK_MAX_BYTES));
      for (int i = length; i < longer; i++) {
        bytes[i] = random8();
      }
      if (next(script) % 2) {
        bytes[2] = (uint8_t)longer;  // a corrupted length that looks right
      }
      push(pipe, bytes, longer, step);
      return;
    }
    default: push(pipe, bytes, length, step); return;
  }
}

// Takes the packets off that are due, oldest first; the later ones stay.
static int arrived(pipe_t *pipe, int step, flight_t *out) {
  int count = 0, kept = 0;
  for (int i = 0; i < pipe->count; i++) {
    if (pipe->packets[i].due <= step) {
      out[count++] = pipe->packets[i];
    } else {
      pipe->packets[kept++] = pipe->packets[i];
    }
  }
  pipe->count = kept;
  return count;
}
