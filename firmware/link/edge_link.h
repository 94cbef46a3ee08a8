/**
 * @file edge_link.h
 * The packets between the STM32 and the GAP8: samples one way, the network's outputs the other.
 * Each is at most 98 bytes, all that a CPX packet carries; numbers are little endian.
 *
 *   0  version (EDGE_LINK_VERSION)      3  session, 0 for none
 *   1  type (edgeLinkType_t)            4  sequence, 4 bytes
 *   2  length of the whole packet       8  body, then CRC-16/CCITT-FALSE over all before it, 2 bytes
 *
 * The two ends are link_sender.h and link_receiver.h; host/docs/link.md says how they talk.
 * No OS, no heap, no global.
 *
 * Target: C11, any processor of either byte order; no floating point.
 * Threads: pure functions without state: any number at once.
 * Memory: edgeLinkPacket_t, about 100 bytes, and as many of the caller's for its bytes.
 * Cost: two steps a byte for the checksum, by a table of 16 values.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define EDGE_LINK_VERSION 0xA1
#define EDGE_LINK_MAX_BYTES 98  ///< of a packet
#define EDGE_LINK_SAMPLE_BYTES 12
#define EDGE_LINK_SAMPLES 7       ///< in a packet, at most
#define EDGE_LINK_OUTPUTS 3       ///< int8 values of one answer
#define EDGE_LINK_ANSWERS 7       ///< in a packet, at most
#define EDGE_LINK_DIGEST_BYTES 8  ///< of a model's SHA-256

/** What a sample is, and which network takes it. */
typedef enum {
  EDGE_LINK_BEST = 1,          ///< 12 int8: motion_channels.h, quantised; outputs: over, entry, exit
  EDGE_LINK_PAPER = 2,         ///< 3 float32: fused features; outputs: off, over, unused
  EDGE_LINK_PAPER_STREAM = 3,  ///< the same samples and outputs, another network
} edgeLinkAlgorithm_t;

typedef enum {
  EDGE_LINK_RESET = 1,      ///< STM32 to GAP8: a new session begins
  EDGE_LINK_FEATURES = 2,   ///< STM32 to GAP8: 1 to 7 samples in a row
  EDGE_LINK_RESULT = 3,     ///< GAP8 to STM32: the answer to each of the two above
  EDGE_LINK_HEARTBEAT = 4,  ///< GAP8 to STM32, about twice a second while the STM32 speaks
} edgeLinkType_t;

/** Flags of a result. */
enum {
  EDGE_LINK_UNKNOWN = 1,   ///< the session is not the GAP8's: it was reset, or never told
  EDGE_LINK_GAP = 2,       ///< the samples begin after the expected one; none was used
  EDGE_LINK_FILLING = 4,   ///< the network has not seen a whole window of this stream yet
  EDGE_LINK_MISMATCH = 8,  ///< the GAP8 has another model, or none, for this algorithm
  EDGE_LINK_EMPTY = 16,    ///< no sample of this session has come yet; `expected` means nothing
};

/** RESET: the header's session begins. */
typedef struct {
  uint32_t nonce;  ///< differs from start to start of the STM32, so that session numbers may begin anew
  uint8_t algorithm;
  uint8_t digest[EDGE_LINK_DIGEST_BYTES];  ///< of the model whose answers the STM32 will understand
} edgeLinkReset_t;

/** FEATURES: the header's sequence is the first sample's. */
typedef struct {
  uint16_t back;  ///< the oldest sample that the sender can still send lies so many before the first
  uint8_t count;
  uint8_t sample[EDGE_LINK_SAMPLES][EDGE_LINK_SAMPLE_BYTES];
} edgeLinkFeatures_t;

/** One output of the network. */
typedef struct {
  uint8_t back;  ///< it was computed at sample `expected` - back, back from 1 on
  int8_t output[EDGE_LINK_OUTPUTS];
} edgeLinkAnswer_t;

/** RESULT: the header echoes session and sequence of what it answers. */
typedef struct {
  uint32_t expected;  ///< the sample that the receiver waits for: all before it have been used
  uint8_t flags;
  uint8_t count;
  edgeLinkAnswer_t answer[EDGE_LINK_ANSWERS];  ///< the newest ones, oldest first; repeated from packet to packet
} edgeLinkResult_t;

/** HEARTBEAT: the header's session is the GAP8's, 0 for none; its sequence counts heartbeats. */
typedef struct {
  uint32_t uptimeMs;
  uint32_t expected;
  uint32_t samplesTaken;    ///< used since start
  uint32_t samplesLost;     ///< that never came
  uint32_t packetsRefused;  ///< that were not understood
  uint8_t algorithm;        ///< 0 for none
  uint8_t flags;            ///< as in a result
  uint8_t digest[EDGE_LINK_DIGEST_BYTES];
} edgeLinkHeartbeat_t;

/** One packet, unpacked. */
typedef struct {
  uint8_t type;
  uint8_t session;
  uint32_t sequence;
  union {
    edgeLinkReset_t reset;
    edgeLinkFeatures_t features;
    edgeLinkResult_t result;
    edgeLinkHeartbeat_t heartbeat;
  };
} edgeLinkPacket_t;

/** CRC-16/CCITT-FALSE (polynomial 0x1021, start 0xffff); 0x29b1 for "123456789". */
uint16_t edgeLinkCrc(const uint8_t *bytes, uint16_t length);

/**
 * Writes a packet.
 * @param bytes  EDGE_LINK_MAX_BYTES of room
 * @return its length, 0 for an unknown type or a count out of range
 */
uint16_t edgeLinkPack(const edgeLinkPacket_t *packet, uint8_t *bytes);

/**
 * Reads a packet; takes any bytes of any length.
 * @return false, with @p packet undefined, unless version, type, length, counts and CRC are all right
 */
bool edgeLinkParse(const uint8_t *bytes, uint16_t length, edgeLinkPacket_t *packet);

/** The digest of a model from the hexadecimal text of its SHA-256, at least 16 digits. */
void edgeLinkDigest(const char *sha256, uint8_t digest[EDGE_LINK_DIGEST_BYTES]);

/** a - b of sequence numbers, which wrap. */
static inline int32_t edgeLinkAfter(uint32_t a, uint32_t b) { return (int32_t)(a - b); }

#ifdef __cplusplus
}
#endif
