// What stands for the hardware around the emulated STM32: sensors, deck, memory, radio, clock. Linked by `make emulate`
// with the firmware's own objects in place of the functions named in build.py (ld --wrap); nothing of it flies.
// It talks to the desktop through two pipes, by semihosting, in frames: kind (1 byte), length (2), bytes.
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#include "FreeRTOS.h"
#include "queue.h"
#include "semphr.h"
#include "task.h"

#include "bmi088.h"
#include "bmp3.h"
#include "deck.h"
#include "deck_discovery.h"
#include "eeprom.h"
#include "log.h"
#include "param.h"
#include "pmw3901.h"
#include "stm32fxxx.h"
#include "syslink.h"
#include "vl53l1x.h"

#define LINE 120
#define VARIABLES 64
#define ROW 15  // values of a recorded row, app_sensors.c
#define CLOCK_MHZ 168
#define FLYING 'F'
#define BYTES 1024  // of the largest frame

typedef struct {
  int16_t gyro[2][3];  // samples of two milliseconds, the BMI088's own units
  int16_t acc[2][3];
  uint16_t range;   // mm
  int16_t flow[2];  // counts since the last block, the PMW3901's axes
} block_t;

enum { OPEN = 1, WRITE = 5, READ = 6, EXIT = 0x18 };  // semihosting

static int input, output;  // of the desktop
static uint8_t mode;       // FLYING, or rows of a recorded flight
static uint8_t appRuns;
static uint8_t wholeMilliseconds;  // of the microseconds' clock
static TaskHandle_t app;
static block_t block;
static int millisecond;    // of the block
static int16_t counts[2];  // of the optical flow, since it was last read
static bool ending;        // a task is to report the stacks and stop
static bool sensing;       // the gyro's interrupt is set up
static logVarId_t watched[VARIABLES];
static int watchedCount;
static logVarId_t fed[ROW];
static uint8_t frame[BYTES];
static uint8_t memory[EEPROM_SIZE];
static logVarId_t latency;     // us, sensor interrupt to motors: the stabilizer's own
static uint32_t worstLatency;  // since the last report
static uint32_t appOut;

static int semihost(int operation, const void *arguments) {
  register int r0 __asm("r0") = operation;
  register const void *r1 __asm("r1") = arguments;
  __asm volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
  return r0;
}

static void stop(int code) {
  const uint32_t arguments[2] = {0x20026, (uint32_t)code};
  semihost(0x20, arguments);
  while (1) {
  }
}

static void hostRead(void *bytes, uint32_t length) {
  uint32_t left = length;
  while (left > 0) {
    const uint32_t arguments[3] = {(uint32_t)input, (uint32_t)bytes + length - left, left};
    const uint32_t now = (uint32_t)semihost(READ, arguments);
    if (now >= left) {
      stop(2);  // the desktop has gone
    }
    left = now;
  }
}

static void say(uint8_t kind, const void *bytes, uint16_t length) {
  static uint8_t out[3 + BYTES];
  const uint32_t state = __get_PRIMASK();
  __disable_irq();
  out[0] = kind;
  memcpy(&out[1], &length, 2);
  memcpy(&out[3], bytes, length);
  const uint32_t arguments[3] = {(uint32_t)output, (uint32_t)out, 3u + length};
  semihost(WRITE, arguments);
  __set_PRIMASK(state);
}

static int openPipe(const char *name, int how) {
  const uint32_t arguments[3] = {(uint32_t)name, (uint32_t)how, strlen(name)};
  const int file = semihost(OPEN, arguments);
  if (file < 0) {
    stop(3);
  }
  return file;
}

// ---- log variables and parameters, by the firmware's own tables

static logVarId_t find(const char *name) {
  char group[32];
  const char *dot = strchr(name, '.');
  memcpy(group, name, (size_t)(dot - name));
  group[dot - name] = 0;
  return logGetVarId(group, dot + 1);
}

static void put(logVarId_t id, float value) {
  void *at = logGetAddress(id);
  switch (logGetType(id)) {
    case LOG_FLOAT: *(float *)at = value; break;
    case LOG_UINT16: *(uint16_t *)at = (uint16_t)value; break;
    case LOG_INT32: *(int32_t *)at = (int32_t)value; break;
    case LOG_UINT32: *(uint32_t *)at = (uint32_t)value; break;
    default: say('!', "a log variable has another type", 31); stop(4);
  }
}

extern struct log_s _log_start[];

/** A value as the log task sends it: logGetUint() and its like know none that a function gives. */
static uint32_t get(logVarId_t id) {
  uint32_t bits;
  if (_log_start[id].type & LOG_BY_FUNCTION) {
    const logByFunction_t *by = _log_start[id].address;
    const uint32_t now = xTaskGetTickCount();
    switch (logGetType(id)) {
      case LOG_UINT8: return by->acquireUInt8(now, by->data);
      case LOG_UINT16: return by->acquireUInt16(now, by->data);
      case LOG_UINT32: return by->acquireUInt32(now, by->data);
      case LOG_INT8: return (uint32_t)by->acquireInt8(now, by->data);
      case LOG_INT16: return (uint32_t)by->acquireInt16(now, by->data);
      case LOG_INT32: return (uint32_t)by->acquireInt32(now, by->data);
      default: {
        const float value = by->aquireFloat(now, by->data);
        memcpy(&bits, &value, 4);
        return bits;
      }
    }
  }
  if (logGetType(id) == LOG_FLOAT) {
    const float value = logGetFloat(id);
    memcpy(&bits, &value, 4);
  } else if (logGetType(id) == LOG_INT16 || logGetType(id) == LOG_INT32 || logGetType(id) == LOG_INT8) {
    bits = (uint32_t)logGetInt(id);
  } else {
    bits = logGetUint(id);
  }
  return bits;
}

/** Names, each ended by a zero, into ids; their types go back, 0 for one that the firmware does not have. */
static void names(const uint8_t *text, uint16_t length, logVarId_t *ids, int *count) {
  uint8_t types[VARIABLES] = {0};
  *count = 0;
  for (uint16_t at = 0; at < length && *count < VARIABLES; at += (uint16_t)strlen((const char *)text + at) + 1) {
    ids[*count] = find((const char *)text + at);
    types[*count] = logVarIdIsValid(ids[*count]) ? (uint8_t)logGetType(ids[*count]) : 0;
    (*count)++;
  }
  say('T', types, (uint16_t)*count);
}

static void setParam(const uint8_t *bytes) {
  float value;
  memcpy(&value, bytes, 4);
  const paramVarId_t id = paramGetVarIdFromComplete((const char *)bytes + 4);
  if (!PARAM_VARID_IS_VALID(id)) {
    say('!', "no such parameter", 17);
    stop(4);
  }
  if (paramGetType(id) == PARAM_FLOAT) {
    paramSetFloat(id, value);
  } else {
    paramSetInt(id, (int)value);
  }
}

static void report(uint8_t kind) {
  uint32_t values[VARIABLES + 2] = {xTaskGetTickCount(), worstLatency};
  for (int i = 0; i < watchedCount; i++) {
    values[2 + i] = get(watched[i]);
  }
  worstLatency = 0;
  say(kind, values, (uint16_t)(4 * (2 + watchedCount)));
}

/** Unused words of every task's stack: name, 10 bytes, and 2 of the count. */
static void stacks(void) {
  static TaskStatus_t tasks[40];
  static struct __attribute__((packed)) {
    char name[10];
    uint16_t left;
  } row[40];
  const UBaseType_t count = uxTaskGetSystemState(tasks, 40, NULL);
  for (UBaseType_t i = 0; i < count; i++) {
    strncpy(row[i].name, tasks[i].pcTaskName, 10);
    row[i].left = tasks[i].usStackHighWaterMark;
  }
  say('K', row, (uint16_t)(count * sizeof row[0]));
}

// ---- the radio's processor: packets of the syslink

static SyslinkPacket radioStorage[8];
static StaticQueue_t radioMemory;
static QueueHandle_t radio;

void __wrap_uartslkInit(void) {
  radio = xQueueCreateStatic(8, sizeof(SyslinkPacket), (uint8_t *)radioStorage, &radioMemory);
}

bool __wrap_uartslkTest(void) { return true; }

void __wrap_uartslkGetPacketBlocking(SyslinkPacket *packet) { xQueueReceive(radio, packet, portMAX_DELAY); }

void __wrap_uartslkSendDataDmaBlocking(uint32_t size, uint8_t *data) {
  if (data[2] < SYSLINK_PM_GROUP) {
    say('L', data + 2, (uint16_t)(size - 4));  // less start and checksum
  } else if (data[2] == SYSLINK_OW_SCAN) {
    SyslinkPacket none = {.type = SYSLINK_OW_SCAN, .length = 1};
    xQueueSend(radio, &none, 0);
  }
}

// ---- UART2, where the AI-deck is

static uint8_t deckBytes[512];
static StaticQueue_t deckMemory;
static QueueHandle_t deckQueue;
static uint8_t deckThere;

void __wrap_uart2Init(const uint32_t baudrate) {
  (void)baudrate;
  if (deckQueue == NULL) {
    deckQueue = xQueueCreateStatic(sizeof deckBytes, 1, deckBytes, &deckMemory);
  }
}

int __wrap_uart2GetDataWithTimeout(size_t size, uint8_t *buffer, const uint32_t ticks) {
  for (size_t i = 0; i < size; i++) {
    if (xQueueReceive(deckQueue, &buffer[i], ticks) != pdTRUE) {
      return (int)i;
    }
  }
  return (int)size;
}

int __wrap_uart2GetData(size_t size, uint8_t *buffer) {
  return __wrap_uart2GetDataWithTimeout(size, buffer, portMAX_DELAY);
}

static void listenAlone(void);

/** What the deck says to that is here before the next byte goes out. */
void __wrap_uart2SendData(uint32_t size, uint8_t *data) {
  say('U', data, (uint16_t)size);
  if (deckThere) {
    listenAlone();
  }
}

// ---- what the desktop has to say

static void enqueue(QueueHandle_t queue, const void *item) {
  if (queue == NULL) {
    return;
  }
  if (__get_IPSR() == 0) {
    xQueueSend(queue, item, 0);
  } else {
    BaseType_t woken = pdFALSE;
    xQueueSendFromISR(queue, item, &woken);
    portYIELD_FROM_ISR(woken);
  }
}

/** Frames up to the one that says go on. */
static void listen(void) {
  while (1) {
    uint8_t head[3];
    uint16_t length;
    hostRead(head, 3);
    memcpy(&length, head + 1, 2);
    if (length > BYTES) {
      stop(5);
    }
    hostRead(frame, length);
    switch (head[0]) {
      case 'G':  // go on
        return;
      case 'B':  // begin: mode, whether the app runs, whether an AI-deck is there, whether time goes in whole
                 // milliseconds
        mode = frame[0];
        appRuns = frame[1];
        deckThere = frame[2];
        wholeMilliseconds = frame[3];
        break;
      case 'N':  // names to report
        names(frame, length, watched, &watchedCount);
        break;
      case 'V':  // a row of a recorded flight
        for (int i = 0; i < ROW; i++) {
          float value;
          memcpy(&value, frame + 4 * i, 4);
          put(fed[i], value);
        }
        break;
      case 'W': {  // its names
        int count;
        names(frame, length, fed, &count);
        break;
      }
      case 'P': setParam(frame); break;
      case 'I':
        memcpy(&block, frame, sizeof block);
        counts[0] = (int16_t)(counts[0] + block.flow[0]);
        counts[1] = (int16_t)(counts[1] + block.flow[1]);
        millisecond = 0;
        break;
      case 'L': enqueue(radio, frame); break;
      case 'U':
        for (uint16_t i = 0; i < length; i++) {
          enqueue(deckQueue, &frame[i]);
        }
        break;
      case 'E': ending = true; return;
      default: stop(6);
    }
  }
}

/** The same, with nobody else at the pipe meanwhile. */
static void listenAlone(void) {
  const uint32_t state = __get_PRIMASK();
  __disable_irq();
  listen();
  __set_PRIMASK(state);
}

/** The firmware's tables are there: what is to be reported and fed can be said. */
static void meet(void) {
  static bool met;
  if (!met) {
    met = true;
    latency = find("stabilizer.intToOut");
    say('R', NULL, 0);
    listen();
  }
}

// ---- start

extern uint32_t _estack;
extern uint32_t g_pfnVectors;
void Reset_Handler(void);
// board.ld and build.py put these where the bootloader is, and where the firmware looks for its own of them.
__attribute__((section(".boot"), used)) static const void *const boot[2] = {&_estack, (const void *)Reset_Handler};
__attribute__((section(".device"), used)) static const char device[32] = DEVICE;  // build.py
__attribute__((section(".number"), used)) static const uint16_t number[10] = {1, 0, 2, 0, 3, 0, 0, 0, 0, 1024};

void __wrap_SystemInit(void) {
  SCB->CPACR |= 0xfu << 20;  // the FPU
  SCB->VTOR = (uint32_t)&g_pfnVectors;
  input = openPipe("to_board", 1);
  output = openPipe("from_board", 5);
  listen();
}

static bool deckBegin(void) { return true; }

static DeckInfo *nextDeck(void) {
  static DeckInfo info;
  static int given;
  static char *const all[] = {"bcFlow2", "bcAI"};
  if (given == 1 + deckThere) {
    return NULL;
  }
  memset(&info, 0, sizeof info);
  info.productName = all[given++];
  return &info;
}

static const DeckDiscoveryBackend_t emulated = {.name = "emulated", .init = deckBegin, .getNextDeck = nextDeck};
DECK_DISCOVERY_BACKEND(emulated);

void __wrap_usecTimerInit(void) {}

uint64_t __wrap_usecTimestamp(void) {
  uint32_t tick, left;
  if (wholeMilliseconds) {
    return 1000ull * xTaskGetTickCountFromISR();
  }
  do {
    tick = xTaskGetTickCountFromISR();
    left = SysTick->VAL;
    if ((SCB->ICSR & SCB_ICSR_PENDSTSET_Msk) && left > SysTick->LOAD / 2) {
      tick++;  // it has begun, and its interrupt waits
    }
  } while (left < SysTick->VAL);
  return 1000ull * tick + (SysTick->LOAD - left) / CLOCK_MHZ;
}

bool __wrap_eepromInit(I2C_Dev *port) {
  (void)port;
  return true;
}
bool __wrap_eepromTest(void) { return true; }
bool __wrap_eepromTestConnection(void) { return true; }
bool __wrap_eepromReadBuffer(uint8_t *buffer, uint16_t at, uint16_t length) {
  memcpy(buffer, memory + at, length);
  return true;
}
bool __wrap_eepromWriteBuffer(const uint8_t *buffer, uint16_t at, uint16_t length) {
  memcpy(memory + at, buffer, length);
  return true;
}

// ---- sensors

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
  sensing = true;  // interrupts are set up by then
  return BMI088_OK;
}

uint16_t __wrap_bmi088_get_gyro_data(struct bmi088_sensor_data *data, struct bmi088_dev *dev) {
  (void)dev;
  const int16_t *now = block.gyro[millisecond];
  data->x = sensing ? now[0] : 1;  // the self-test takes zeros for a broken sensor
  data->y = now[1];
  data->z = now[2];
  return BMI088_OK;
}

uint16_t __wrap_bmi088_get_accel_data(struct bmi088_sensor_data *data, struct bmi088_dev *dev) {
  (void)dev;
  const int16_t *now = block.acc[millisecond];
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
  motion->deltaX = counts[0];
  motion->deltaY = counts[1];
  counts[0] = counts[1] = 0;
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
  data->RangeMilliMeter = (int16_t)block.range;
  return VL53L1_ERROR_NONE;
}

// ---- console, faults

int __real_consolePutchar(int ch);
int __wrap_consolePutchar(int ch) {
  static char line[LINE];
  static uint16_t length;
  line[length++] = (char)ch;
  if (ch == '\n' || length == LINE) {
    say('C', line, length);
    length = 0;
  }
  return __real_consolePutchar(ch);
}

void __wrap_assertFail(char *what, char *file, int line) {
  static char text[LINE + 16];
  uint16_t length = 0;
  for (const char *c = what; *c && length < 60; c++) {
    text[length++] = *c;
  }
  text[length++] = ' ';
  const char *name = strrchr(file, '/') ? strrchr(file, '/') + 1 : file;
  for (const char *c = name; *c && length < LINE; c++) {
    text[length++] = *c;
  }
  text[length++] = ':';
  char digits[8];
  int count = 0;
  for (int n = line; n > 0; n /= 10) {
    digits[count++] = (char)('0' + n % 10);
  }
  while (count > 0) {
    text[length++] = digits[--count];
  }
  say('!', text, length);
  stop(7);
}

/** Both are called where the firmware would halt: BusFault and its like, and HardFault. */
void __wrap_storeAssertTextData(const char *text) {
  say('!', text, (uint16_t)strlen(text));
  stop(7);
}

void __wrap_storeAssertHardfaultData(unsigned r0, unsigned r1, unsigned r2, unsigned r3, unsigned r12, unsigned lr,
                                     unsigned pc, unsigned psr) {
  const uint32_t registers[8] = {r0, r1, r2, r3, r12, lr, pc, psr};
  say('X', registers, sizeof registers);
  stop(8);
}

// ---- time, and the app's step

void __real_appMain(void);
void __wrap_appMain(void) {
  app = xTaskGetCurrentTaskHandle();
  if (mode != FLYING) {
    meet();
  }
  if (!appRuns) {
    vTaskDelay(portMAX_DELAY);
  }
  __real_appMain();
}

/** A step of the app ends where it begins to wait for the next. */
void __real_vTaskDelayUntil(TickType_t *due, const TickType_t period);
void __wrap_vTaskDelayUntil(TickType_t *due, const TickType_t period) {
  const bool step = app != NULL && xTaskGetCurrentTaskHandle() == app;
  if (step && appOut++ > 0) {
    report('S');
  }
  __real_vTaskDelayUntil(due, period);
  if (step && mode != FLYING) {
    if (deckThere) {
      say('A', NULL, 0);  // its turn, and not the deck's
      listenAlone();
    } else {
      listen();
    }
  }
  if (ending) {
    stacks();
    stop(0);
  }
}

/** QEMU's EXTI raises no line by software: the gyro's is asked for here. */
static bool gyroWaits;
ITStatus __real_EXTI_GetITStatus(uint32_t line);
ITStatus __wrap_EXTI_GetITStatus(uint32_t line) {
  if (line == EXTI_Line14 && gyroWaits) {
    gyroWaits = false;
    return SET;
  }
  return __real_EXTI_GetITStatus(line);
}

/** Every millisecond: the gyro's interrupt; every second one new samples, and the motors go out. */
BaseType_t __real_xTaskIncrementTick(void);
BaseType_t __wrap_xTaskIncrementTick(void) {
  static bool odd;
  const BaseType_t woken = __real_xTaskIncrementTick();
  if (mode == FLYING && sensing && !ending) {
    odd = !odd;
    millisecond = 1;
    if (odd) {
      meet();
    }
    const uint32_t now = logGetUint(latency);
    worstLatency = now > worstLatency ? now : worstLatency;
    if (odd) {
      report('M');
      listen();
    }
    gyroWaits = true;
    NVIC_SetPendingIRQ(EXTI15_10_IRQn);
  }
  return woken;
}
