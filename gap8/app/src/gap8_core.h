/**
 * @file gap8_core.h
 * Everything that the GAP8 app does, without an operating system: packets from the STM32 in,
 * networks, packets for the STM32 out. The PMSIS app (main.c) gives it CPX, the cluster and a clock;
 * tests give it a byte pipe. No heap, no global; about 12 kB, so that it lies in L1.
 */
#pragma once

#include "link_receiver.h"
#include "network_int8.h"
#include "stream_int8.h"

#include "airtouch_model.h"
#include "airtouch_stream.h"

#define GAP8_NETWORKS 2
#define GAP8_VALUES (AIRTOUCH_MODEL_ROWS * AIRTOUCH_MODEL_COLUMNS)

/** The streaming network and its past. */
typedef struct {
  const streamInt8_t *network;
  streamState_t state;
  _Alignas(4) int8_t arena[AIRTOUCH_STREAM_ARENA_BYTES];
} gap8Stream_t;

/** The cores that share the windowed network. */
typedef struct {
  void (*fork)(void (*work)(void *argument), void *argument);  ///< runs work on all of them; returns when all have
  int32_t (*core)(void);                                       ///< the one that calls: 0 to cores - 1
  void (*barrier)(void *unused);                               ///< returns once all have called it
  int32_t cores;
} gap8Team_t;

/** The windowed network and the last features. */
typedef struct {
  const networkInt8_t *network;
  const gap8Team_t *team;
  const int8_t *logits;  ///< of the last run, in the arena
  float ring[GAP8_VALUES];  ///< rows of features, the oldest at `oldest`
  float window[GAP8_VALUES];  ///< normalised
  float column[AIRTOUCH_MODEL_COLUMNS][AIRTOUCH_MODEL_ROWS];
  int32_t oldest;
  int32_t rows;  ///< seen since the reset, at most a window of them
  _Alignas(4) int8_t quantised[GAP8_VALUES];
  _Alignas(4) int8_t arena[AIRTOUCH_MODEL_ARENA_BYTES];
} gap8Window_t;

/** The app. It points into itself: initialise it where it stays, never copy it. */
typedef struct {
  linkReceiver_t receiver;
  linkNetwork_t networks[GAP8_NETWORKS];
  gap8Stream_t stream;
  gap8Window_t window;
} gap8Core_t;

/**
 * Sets the app up, as after a reset of the GAP8.
 * @param stream  the network of `best`, in the memory where it shall be read
 * @param window  the network of `paper`; both as exported, and they must outlive the core
 * @param team    the cores that share it, NULL for the calling one alone; must outlive the core
 */
void gap8CoreInit(gap8Core_t *core, const streamInt8_t *stream, const networkInt8_t *window, const gap8Team_t *team);

/**
 * Takes a packet from the STM32: any bytes of any length.
 * @param reply  EDGE_LINK_MAX_BYTES of room
 * @return the reply's length; 0 for none
 * Runs a network up to seven times; integer arithmetic, but for the windowed network's normalisation, which the
 * cores share as well.
 */
uint16_t gap8CoreTake(gap8Core_t *core, const uint8_t *bytes, uint16_t length, uint8_t *reply);

/** A heartbeat to send, about twice a second; @return its length. */
uint16_t gap8CoreHeartbeat(gap8Core_t *core, uint32_t uptimeMs, uint8_t *bytes);
