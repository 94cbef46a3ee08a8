/**
 * @file board.h
 * What stands for the hardware around the emulated STM32. Linked by `make emulate` with the firmware's own objects in
 * place of the functions named in build.py (ld --wrap); nothing of it flies.
 *
 * pipe.c: frames to and from the desktop; desktop.c: what its frames mean; tables.c: log variables and parameters;
 * serial.c: radio and AI-deck; start.c: start, decks, memory, clock; sensors.c; time.c: tick and steps; faults.c.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#define BOARD_BYTES 1024  // of the largest frame
#define BOARD_FLYING 'F'

/** What the sensors read in two milliseconds: the desktop's frame 'I'. */
typedef struct {
  int16_t gyro[2][3];  // a sample a millisecond, the BMI088's own units
  int16_t acc[2][3];
  uint16_t range;   // mm
  int16_t flow[2];  // counts since the last block, the PMW3901's axes
} boardBlock_t;

/** The board's state; what only one file uses is there. */
typedef struct {
  uint8_t mode;  // BOARD_FLYING, or rows of a recorded flight
  uint8_t appRuns;
  uint8_t deckThere;          // an AI-deck
  uint8_t wholeMilliseconds;  // of the microseconds' clock
  bool sensing;               // the gyro's interrupt is set up
  bool ending;                // a task is to report the stacks and stop
  boardBlock_t block;
  int millisecond;    // of the block
  int16_t counts[2];  // of the optical flow, since it was last read
} board_t;

extern board_t board;

/** Ends the emulation with an exit code. */
void boardStop(int code) __attribute__((noreturn));

/** Opens the two pipes. */
void boardConnect(void);

/** Reads bytes from the desktop; waits for them. */
void boardRead(void *bytes, uint32_t length);

/** A frame to the desktop. */
void boardSay(uint8_t kind, const void *bytes, uint16_t length);

/** Takes the desktop's frames up to the one that says go on. */
void boardListen(void);

/** The same, with nobody else at the pipe meanwhile. */
void boardListenAlone(void);

/** At the first call: the firmware's tables are there, so what is to be reported and fed can be said. */
void boardMeet(void);

/** Names of log variables, each ended by a zero: to be reported at each step, or fed from rows of a recorded flight. */
void boardWatch(const uint8_t *text, uint16_t length);
void boardFeedNames(const uint8_t *text, uint16_t length);

/** A row of a recorded flight, floats in the order of the names, into the log variables. */
void boardFeed(const uint8_t *row);

/** Sets a parameter: 4 bytes of a float, and its whole name. */
void boardSetParam(const uint8_t *bytes);

/** Notes the stabilizer's latency of this step for the next report. */
void boardNoteLatency(void);

/** Tick, worst latency and watched values to the desktop. */
void boardReport(uint8_t kind);

/** The unused words of every task's stack to the desktop. */
void boardStacks(void);

/** A syslink packet from the radio's processor; bytes from the AI-deck. */
void boardRadioGives(const void *packet);
void boardDeckGives(const uint8_t *bytes, uint16_t length);
