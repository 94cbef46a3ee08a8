/**
 * @file link_receiver.h
 * The GAP8's end of the link. It gives every sample to the network once and in order: doubled and
 * late ones are dropped, missing ones asked for again. Where samples are gone for good the network
 * is reset, and gives no answer before it has seen a whole window of the new stream; so each
 * answer is what the network would have given without any fault.
 *
 * Target: C11, any processor; no floating point.
 * Threads: no globals: different objects may be used at once; one object by one thread at a time.
 * Memory: linkReceiver_t, about 120 bytes; the networks are the caller's.
 * Cost: a packet: its parsing, and the network at most EDGE_LINK_SAMPLES times.
 */
#pragma once

#include "edge_link.h"

#ifdef __cplusplus
extern "C" {
#endif

#define LINK_BEATS 20  ///< heartbeats after the last packet: ten seconds of them; no source: round number

/** A network as the receiver sees it. */
typedef struct {
  void *context;
  void (*reset)(void *context);  ///< the past becomes unknown
  /** Takes a sample; true, with the outputs, where the network computed something new. */
  bool (*step)(void *context, const uint8_t sample[EDGE_LINK_SAMPLE_BYTES], int8_t output[EDGE_LINK_OUTPUTS]);
  uint16_t window;  ///< samples that an answer depends on
  uint16_t stride;  ///< it computes on every stride-th sample, the first one after a reset included
  uint8_t algorithm;
  uint8_t digest[EDGE_LINK_DIGEST_BYTES];
} linkNetwork_t;

/** The receiver. The networks belong to the caller and must outlive it. */
typedef struct {
  const linkNetwork_t *networks;
  const linkNetwork_t *network;  ///< the session's, NULL without one
  uint8_t networkCount;
  uint8_t session;  ///< 0 for none
  uint32_t nonce;
  uint8_t oldSession;  ///< the one before: a late reset of it changes nothing
  uint32_t oldNonce;
  bool mismatch;  ///< no network here is the one that the reset asked for
  bool empty;     ///< no sample of this session yet
  uint32_t expected;
  uint32_t filled;  ///< samples that the network has seen since its reset
  uint8_t answers;
  struct {
    uint32_t sequence;
    int8_t output[EDGE_LINK_OUTPUTS];
  } answer[EDGE_LINK_ANSWERS];  ///< the last ones, oldest first
  uint32_t samplesTaken;        ///< used since start
  uint32_t samplesLost;         ///< that never came
  uint32_t packetsRefused;      ///< that were not understood
  uint32_t samplesRepeated;     ///< that had been used before
  uint32_t heartbeats;
  uint8_t beats;  ///< heartbeats left until another packet comes
} linkReceiver_t;

/** Sets the receiver up, without a session. */
void linkReceiverInit(linkReceiver_t *receiver, const linkNetwork_t *networks, uint8_t count);

/**
 * Takes what came from the STM32: any bytes of any length.
 * @param reply  EDGE_LINK_MAX_BYTES of room
 * @return the reply's length; 0 for none
 * Runs the network at most EDGE_LINK_SAMPLES times. Never fails.
 */
uint16_t linkReceiverTake(linkReceiver_t *receiver, const uint8_t *bytes, uint16_t length, uint8_t *reply);

/**
 * A heartbeat.
 * @return its length; 0 for none: the STM32 has never spoken, or not for LINK_BEATS heartbeats. What nobody asked for
 * stays off the wire, where a damaged byte costs the flight (host/docs/flash.md).
 */
uint16_t linkReceiverHeartbeat(linkReceiver_t *receiver, uint32_t uptimeMs, uint8_t *bytes);

#ifdef __cplusplus
}
#endif
