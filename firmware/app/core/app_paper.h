/**
 * @file app_paper.h
 * The two detectors whose network on the GAP8 takes the fused features and answers with a probability: `paper` and
 * `paper-stream`. What the STM32 must know of each is in the headers of gap8/model; its weights are not needed here.
 */
#pragma once

#include "app_types.h"
#include "edge_pipeline.h"

/** One of the two. */
typedef struct {
  const char *sha256;   ///< of the model
  float outputScale;    ///< of its two logits; the probability is their softmax
  float probabilityIn;  ///< as it was tuned, like the three below
  float probabilityOut;
  uint16_t probabilityDwell;
  uint16_t alertHold;
  uint16_t refill;    ///< samples of the past that the network needs before it answers
  uint8_t algorithm;  ///< an edgeLinkAlgorithm_t
} appPaper_t;

/** @return what belongs to a detector (an appDetector_t), NULL where it is none of the two */
const appPaper_t *appPaperOf(uint8_t detector);

/**
 * How probabilities become edges. A setting that stands as shipped, which is as `paper` was tuned, means what the
 * detector in force was tuned to; any other value is taken as it is.
 * @param paper  NULL for another detector: settings are taken as they are
 */
void appPaperDecoding(const appPaper_t *paper, const appParams_t *params, edgePipelineConfig_t *config);
