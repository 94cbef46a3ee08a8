/**
 * @file gap8_core.h
 * Everything that the GAP8 app does, without an operating system: packets from the STM32 in,
 * networks, packets for the STM32 out. The PMSIS app (main.c) gives it CPX, the cluster and a clock;
 * tests give it a byte pipe. No heap, no global; about 9 kB, so that it lies in L1.
 */
#pragma once

#include "fixed_scale.h"
#include "link_receiver.h"
#include "network_int8.h"
#include "rolling_int8.h"
#include "stream_int8.h"

#include "airtouch_model.h"
#include "airtouch_rolling.h"
#include "airtouch_stream.h"

#define GAP8_NETWORKS 3
#define GAP8_VALUES (AIRTOUCH_MODEL_ROWS * AIRTOUCH_MODEL_COLUMNS)

/** The networks as exported, in the memory where they shall be read. All must outlive the core. */
typedef struct {
  const streamInt8_t *best;
  const networkInt8_t *paper;
  const networkInt8_t *paperStream;
  const fixedScale_t *paperStreamScale;
} gap8Models_t;

/** Those of gap8/model where they were compiled: an initialiser. */
#define GAP8_EXPORTED {&airtouchStream, &airtouchNetwork, &airtouchRolling, &airtouchRollingScale}

/** The cores that share the windowed network. */
typedef struct {
  void (*fork)(void (*work)(void *argument), void *argument);  ///< runs work on all of them; returns when all have
  int32_t (*core)(void);                                       ///< the one that calls: 0 to cores - 1
  void (*barrier)(void *unused);                               ///< returns once all have called it
  int32_t cores;
} gap8Team_t;

/** The past of `best`. */
typedef struct {
  streamState_t state;
  _Alignas(4) int8_t arena[AIRTOUCH_STREAM_ARENA_BYTES];
} gap8Best_t;

/** The last features, and what the network of `paper` needs for a window of them. */
typedef struct {
  const int8_t *logits;       ///< of the last run, in the arena
  float ring[GAP8_VALUES];    ///< rows of features, the oldest at `oldest`
  float window[GAP8_VALUES];  ///< normalised
  float column[AIRTOUCH_MODEL_COLUMNS][AIRTOUCH_MODEL_ROWS];
  int32_t oldest;
  int32_t rows;  ///< seen since the reset, at most a window of them
  _Alignas(4) int8_t quantised[GAP8_VALUES];
  _Alignas(4) int8_t arena[AIRTOUCH_MODEL_ARENA_BYTES];
} gap8Paper_t;

/** The past of `paper-stream`. */
typedef struct {
  rollingInt8_t state;
  _Alignas(4) int8_t arena[AIRTOUCH_ROLLING_ARENA_BYTES];
} gap8PaperStream_t;

/** The app. It points into itself: initialise it where it stays, never copy it. */
typedef struct {
  linkReceiver_t receiver;
  linkNetwork_t networks[GAP8_NETWORKS];
  gap8Models_t models;
  const gap8Team_t *team;
  union {  ///< of the network that the session asked for; each is set up by its reset
    gap8Best_t best;
    gap8Paper_t paper;
    gap8PaperStream_t paperStream;
  };
} gap8Core_t;

/**
 * Sets the app up, as after a reset of the GAP8. A network that does not fit the samples and the memory here is left
 * out: whoever asks for it is told that the GAP8 has another one.
 * @param models  where the networks lie
 * @param team    the cores that share `paper`, NULL for the calling one alone; must outlive the core
 * @return how many networks the app has, GAP8_NETWORKS with those of gap8/model
 */
int32_t gap8CoreInit(gap8Core_t *core, const gap8Models_t *models, const gap8Team_t *team);

/**
 * Takes a packet from the STM32: any bytes of any length.
 * @param reply  EDGE_LINK_MAX_BYTES of room
 * @return the reply's length; 0 for none
 * Runs a network up to seven times; integer arithmetic, but for the scale of the features: the cores share that of
 * `paper`.
 */
uint16_t gap8CoreTake(gap8Core_t *core, const uint8_t *bytes, uint16_t length, uint8_t *reply);

/** A heartbeat to send, about twice a second; @return its length, 0 for none: see linkReceiverHeartbeat. */
uint16_t gap8CoreHeartbeat(gap8Core_t *core, uint32_t uptimeMs, uint8_t *bytes);
