/**
 * @file link_sender.h
 * The STM32's end of the link. It keeps the last samples and sends, with each new one, every
 * sample that the GAP8 has not confirmed, seven at most: a few lost packets cost nothing. After
 * a longer fault it goes back to the first unconfirmed sample and sends all from there. A GAP8 that
 * is silent for longer than samples are kept is asked ever less often.
 *
 * One step of 10 ms: linkSenderPush() once, linkSenderPoll() once or twice, and linkSenderTake()
 * for each packet that came. Never waits, never fails.
 *
 * Target: C11, any processor; no floating point.
 * Threads: no globals: different objects may be used at once; one object by one thread at a time.
 * Memory: linkSender_t alone, 3.6 kB, most of it the samples that may be sent again.
 * Cost: a packet: its packing or parsing. No loop over the history.
 */
#pragma once

#include "edge_link.h"

#ifdef __cplusplus
extern "C" {
#endif

/**
 * Samples kept: the longest fault that leaves no gap, in steps. 2.88 s: it holds the 257 samples that `best`, the
 * longest network, needs before it answers, in whole words of 32 flags (appCore_t.airborneBits); no source for the
 * rest.
 */
#define LINK_HISTORY 288
#define LINK_WINDOW 8        ///< packets on their way, at most; no source: round number
#define LINK_RETRY_STEPS 10  ///< without an answer until everything unconfirmed is sent again; no source: round number
/** Steps between two tries; after LINK_HISTORY steps of silence each interval is twice the last. Five doublings. */
#define LINK_RETRY_MOST 320
#define LINK_DOWN_STEPS 50      ///< without an answer until the link counts as down; no source: round number
#define LINK_REFUSED_STEPS 100  ///< between two resets to a GAP8 that has another model; no source: round number

typedef enum {
  LINK_STARTING = 0,  ///< no answer to the reset yet
  LINK_FILLING = 1,   ///< samples arrive; the network has not seen a whole window of them
  LINK_UP = 2,        ///< answers come
  LINK_DOWN = 3,      ///< no RESULT from the GAP8 for LINK_DOWN_STEPS; heartbeats do not count
  LINK_REFUSED = 4,   ///< the GAP8 has another model
} linkState_t;

/** An answer of the network: its outputs at one sample. */
typedef struct {
  uint32_t sequence;
  int8_t output[EDGE_LINK_OUTPUTS];
} linkAnswer_t;

/** What went wrong so far, and how far the answers lag. */
typedef struct {
  uint32_t sent;            ///< packets given to the transport
  uint32_t packetsDropped;  ///< packets that the transport did not take
  uint32_t received;        ///< good packets from the GAP8
  uint32_t packetsRefused;  ///< packets that were not understood
  uint32_t timeouts;        ///< times that everything unconfirmed was sent again for want of an answer
  uint32_t rewinds;         ///< times that the GAP8 asked for samples again
  uint32_t samplesLost;     ///< samples too old to be sent again
  uint32_t resets;          ///< of the GAP8 that were noticed
  uint32_t uptimeMs;        ///< the GAP8's, of its last heartbeat
} linkCounters_t;

/** The sender; plain values, no pointers. */
typedef struct {
  linkCounters_t counters;
  uint8_t history[LINK_HISTORY][EDGE_LINK_SAMPLE_BYTES];
  uint8_t digest[EDGE_LINK_DIGEST_BYTES];
  uint32_t nonce;
  uint32_t samples;         ///< pushed so far: the next one's sequence
  uint32_t base;            ///< the oldest unconfirmed one
  uint32_t next;            ///< the next one to send
  uint32_t lastAnswer;      ///< sequence of the last answer given
  uint16_t refill;          ///< samples that the network needs before it answers
  uint16_t silent;          ///< steps since the GAP8's last RESULT in this session; heartbeats do not count
  uint16_t sinceRetry;      ///< steps since the last try: a reset, or everything that is unconfirmed again
  uint16_t retryInterval;   ///< steps from one try to the next
  uint16_t intervalBefore;  ///< the same before the packet of the last poll
  uint8_t outstanding;      ///< packets on their way
  uint8_t holdOff;          ///< steps in which requests to go back are old news
  uint8_t session;
  uint8_t algorithm;
  uint8_t state;  ///< a linkState_t
  bool answered;
  bool sending;          ///< the packet of the last poll was one of samples
  bool trying;           ///< it was a try: a reset, or everything that is unconfirmed again
  uint32_t sendingFrom;  ///< where `next` stood before it
} linkSender_t;

/**
 * Begins a stream; its first sample has sequence 0.
 * @param algorithm  an edgeLinkAlgorithm_t
 * @param digest     of the model that the GAP8 must have
 * @param refill     samples of the past that the network needs, at most LINK_HISTORY
 * @param nonce      very likely differs from start to start of this processor, as its clock in us does
 * @param session    1 to 255, other than that of the stream before
 */
void linkSenderInit(linkSender_t *sender, uint8_t algorithm, const uint8_t digest[EDGE_LINK_DIGEST_BYTES],
                    uint16_t refill, uint32_t nonce, uint8_t session);

/** Takes the sample of one step. */
void linkSenderPush(linkSender_t *sender, const uint8_t sample[EDGE_LINK_SAMPLE_BYTES]);

/**
 * The packet to send now.
 * @param bytes  EDGE_LINK_MAX_BYTES of room
 * @return its length; 0 for none
 */
uint16_t linkSenderPoll(linkSender_t *sender, uint8_t *bytes);

/** Whether the transport took the packet of the last poll; if not it counts as never sent, and a try as none. */
void linkSenderSent(linkSender_t *sender, bool taken);

/**
 * Takes what came from the GAP8: any bytes of any length.
 * @param answers  EDGE_LINK_ANSWERS of room: the answers that are new, oldest first
 * @return how many
 */
int linkSenderTake(linkSender_t *sender, const uint8_t *bytes, uint16_t length, linkAnswer_t *answers);

/**
 * Notes that the sample of this sequence is answered: for answers that were computed without the GAP8 (app_local.h).
 * @return whether it lies behind the last one that was answered; if not, the answer is old and to be dropped
 */
bool linkSenderAccept(linkSender_t *sender, uint32_t sequence);

/** Samples that wait for confirmation. */
uint32_t linkSenderBacklog(const linkSender_t *sender);

#ifdef __cplusplus
}
#endif
