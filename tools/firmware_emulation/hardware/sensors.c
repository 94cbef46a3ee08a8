// The drivers of the sensors: IMU, barometer, optical flow, range, speed of brushless motors. Each gives the desktop's
// samples, but the last.
#include <string.h>

#include "FreeRTOS.h"
#include "bmi088.h"
#include "bmp3.h"
#include "board.h"
#include "motors.h"
#include "pmw3901.h"
#include "task.h"
#include "vl53l1x.h"

uint16_t __wrap_bmi088_gyro_init(struct bmi088_dev *dev) {
  (void)dev;
  return BMI088_OK;
}
uint16_t __wrap_bmi088_accel_init(struct bmi088_dev *dev) {
  (void)dev;
  return BMI088_OK;
}
uint16_t __wrap_bmi088_set_gyro_power_mode(struct bmi088_dev *dev) {
  (void)dev;
  return BMI088_OK;
}
uint16_t __wrap_bmi088_set_gyro_meas_conf(struct bmi088_dev *dev) {
  (void)dev;
  return BMI088_OK;
}
uint16_t __wrap_bmi088_set_gyro_int_config(struct bmi088_int_cfg *config, struct bmi088_dev *dev) {
  (void)config;
  (void)dev;
  return BMI088_OK;
}
uint16_t __wrap_bmi088_accel_switch_control(struct bmi088_dev *dev, uint8_t on) {
  (void)dev;
  (void)on;
  return BMI088_OK;
}
uint16_t __wrap_bmi088_set_accel_power_mode(struct bmi088_dev *dev) {
  (void)dev;
  return BMI088_OK;
}
uint16_t __wrap_bmi088_set_accel_meas_conf(struct bmi088_dev *dev) {
  (void)dev;
  return BMI088_OK;
}
uint16_t __wrap_bmi088_perform_gyro_selftest(int8_t *result, struct bmi088_dev *dev) {
  (void)dev;
  *result = BMI088_SELFTEST_PASS;
  board.sensing = true;  // interrupts are set up by then
  return BMI088_OK;
}

uint16_t __wrap_bmi088_get_gyro_data(struct bmi088_sensor_data *data, struct bmi088_dev *dev) {
  (void)dev;
  const int16_t *now = board.block.gyro[board.millisecond];
  data->x = board.sensing ? now[0] : 1;  // the self-test takes zeros for a broken sensor
  data->y = now[1];
  data->z = now[2];
  return BMI088_OK;
}

uint16_t __wrap_bmi088_get_accel_data(struct bmi088_sensor_data *data, struct bmi088_dev *dev) {
  (void)dev;
  const int16_t *now = board.block.acc[board.millisecond];
  data->x = now[0];
  data->y = now[1];
  data->z = now[2];
  return BMI088_OK;
}

extern uint8_t bmp3_chip_id;
int8_t __wrap_bmp3_init(struct bmp3_dev *dev) {
  (void)dev;
  bmp3_chip_id = BMP388_CHIP_ID;
  return BMP3_OK;
}
int8_t __wrap_bmp3_set_sensor_settings(uint32_t wanted, struct bmp3_dev *dev) {
  (void)wanted;
  (void)dev;
  return BMP3_OK;
}
int8_t __wrap_bmp3_set_op_mode(struct bmp3_dev *dev) {
  (void)dev;
  return BMP3_OK;
}
int8_t __wrap_bmp3_get_sensor_data(uint8_t which, struct bmp3_data *data, struct bmp3_dev *dev) {
  (void)which;
  (void)dev;
  data->temperature = 25.0f;
  data->pressure = 101325.0f;
  return BMP3_OK;
}

bool __wrap_pmw3901Init(const deckPin_t pin) {
  (void)pin;
  return true;
}
void __wrap_pmw3901ReadMotion(const deckPin_t pin, motionBurst_t *motion) {
  (void)pin;
  memset(motion, 0, sizeof *motion);
  taskENTER_CRITICAL();
  motion->motion = 0xb0;
  motion->deltaX = board.counts[0];
  motion->deltaY = board.counts[1];
  board.counts[0] = board.counts[1] = 0;
  taskEXIT_CRITICAL();
}

bool __wrap_vl53l1xInit(VL53L1_Dev_t *dev, I2C_Dev *port) {
  (void)dev;
  (void)port;
  return true;
}
VL53L1_Error __wrap_VL53L1_StopMeasurement(VL53L1_DEV dev) {
  (void)dev;
  return VL53L1_ERROR_NONE;
}
VL53L1_Error __wrap_VL53L1_StartMeasurement(VL53L1_DEV dev) {
  (void)dev;
  return VL53L1_ERROR_NONE;
}
VL53L1_Error __wrap_VL53L1_SetDistanceMode(VL53L1_DEV dev, VL53L1_DistanceModes far) {
  (void)dev;
  (void)far;
  return VL53L1_ERROR_NONE;
}
VL53L1_Error __wrap_VL53L1_SetMeasurementTimingBudgetMicroSeconds(VL53L1_DEV dev, uint32_t time) {
  (void)dev;
  (void)time;
  return VL53L1_ERROR_NONE;
}
VL53L1_Error __wrap_VL53L1_GetMeasurementDataReady(VL53L1_DEV dev, uint8_t *ready) {
  (void)dev;
  *ready = 1;
  return VL53L1_ERROR_NONE;
}
VL53L1_Error __wrap_VL53L1_GetRangingMeasurementData(VL53L1_DEV dev, VL53L1_RangingMeasurementData_t *data) {
  (void)dev;
  memset(data, 0, sizeof *data);
  data->RangeMilliMeter = (int16_t)board.block.range;
  return VL53L1_ERROR_NONE;
}

/** What the motors report, so that the firmware arms: 2000 rev/min at the PWM of 7000 of an armed motor at rest. */
uint16_t __wrap_motorsGetRPM(uint32_t id) { return (uint16_t)(motorsGetRatio(id) * 2 / 7); }
