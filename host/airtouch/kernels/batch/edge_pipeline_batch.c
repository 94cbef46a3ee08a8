#include "edge_pipeline_batch.h"

#include "edge_pipeline.h"

int64_t edgePipelineSize(void) { return (int64_t)sizeof(edgePipeline_t); }

int32_t edgePipelineBatch(const edgePipelineConfig_t *config, const edgeSample_t *sample, int64_t samples, void *state,
                          edgeEvent_t *event) {
  edgePipeline_t *pipeline = state;
  if (!edgePipelineInit(pipeline, config)) {
    return -1;
  }
  for (int64_t i = 0; i < samples; i++) {
    edgePipelineStep(pipeline, &sample[i], &event[i]);
  }
  return 0;
}
