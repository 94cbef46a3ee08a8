// A whole flight through edge_pipeline.h.
#include <stdint.h>

#include "kernel_types.h"

/** One event a sample. `state` has edgePipelineSize() bytes. Returns 0, or -1 when the settings are out of range
 *  or larger than the build has room for. */
int32_t edgePipelineBatch(const edgePipelineConfig_t *config, const edgeSample_t *sample, int64_t samples, void *state,
                          edgeEvent_t *event);
/** RAM of the whole pipeline, bytes. */
int64_t edgePipelineSize(void);
/** The settings that a drone starts with. */
void edgePipelineDefaults(edgePipelineConfig_t *config, const airtouchVehicle_t *vehicle);
