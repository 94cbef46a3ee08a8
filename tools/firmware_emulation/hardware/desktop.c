// What the desktop has to say.
#include <string.h>

#include "board.h"
#include "stm32fxxx.h"

board_t board;
static uint8_t frame[BOARD_BYTES];

void boardListen(void) {
  while (1) {
    uint8_t head[3];
    uint16_t length;
    boardRead(head, 3);
    memcpy(&length, head + 1, 2);
    if (length > BOARD_BYTES) {
      boardStop(5);
    }
    boardRead(frame, length);
    switch (head[0]) {
      case 'G':  // go on
        return;
      case 'B':  // begin: mode, whether the app runs, whether an AI-deck is there, whether time goes in whole
                 // milliseconds
        board.mode = frame[0];
        board.appRuns = frame[1];
        board.deckThere = frame[2];
        board.wholeMilliseconds = frame[3];
        break;
      case 'N':  // names to report
        boardWatch(frame, length);
        break;
      case 'V': boardFeed(frame); break;  // a row of a recorded flight
      case 'W': boardFeedNames(frame, length); break;
      case 'P': boardSetParam(frame); break;
      case 'I':
        memcpy(&board.block, frame, sizeof board.block);
        board.counts[0] = (int16_t)(board.counts[0] + board.block.flow[0]);
        board.counts[1] = (int16_t)(board.counts[1] + board.block.flow[1]);
        board.millisecond = 0;
        break;
      case 'L': boardRadioGives(frame); break;
      case 'U': boardDeckGives(frame, length); break;
      case 'E': board.ending = true; return;
      default: boardStop(6);
    }
  }
}

void boardListenAlone(void) {
  const uint32_t state = __get_PRIMASK();
  __disable_irq();
  boardListen();
  __set_PRIMASK(state);
}

void boardMeet(void) {
  static bool met;
  if (!met) {
    met = true;
    boardSay('R', NULL, 0);
    boardListen();
  }
}
