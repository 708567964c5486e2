/* A master as an application programmer writes one with libmodbus: three axes to float positions, then wait until each arrived.
 *
 * three_axes tcp PORT | three_axes rtu PATH
 * Prints one line for each poll: status and position of the three axes. Exit code 0 when all arrived where they were sent.
 */
#include <errno.h>
#include <modbus.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { AXES = 3, POLLS = 100000 };
enum { COIL_EN = 2000, REG_STATUS = 10010, REG_POS_ACT = 10020, REG_VMAX = 10052, REG_POS_ABS = 10084, ARRIVED = 4 };

static void check(int outcome, const char *what) {
  if (outcome < 0) {
    fprintf(stderr, "%s: %s\n", what, modbus_strerror(errno));
    exit(1);
  }
}

int main(int argc, char **argv) {
  const float vmax[AXES] = {60.0f, 80.0f, 100.0f};
  const float target[AXES] = {42.5f, 85.0f, -7.5f};
  uint16_t words[2 * AXES];
  modbus_t *bus;

  if (argc != 3) return 2;
  if (strcmp(argv[1], "tcp") == 0)
    bus = modbus_new_tcp("127.0.0.1", atoi(argv[2]));
  else
    bus = modbus_new_rtu(argv[2], 38400, 'N', 8, 1);
  if (bus == NULL) return 2;
  check(modbus_set_slave(bus, 1), "slave");
  check(modbus_set_response_timeout(bus, 60, 0), "time-out");
  check(modbus_set_byte_timeout(bus, 60, 0), "time-out");
  check(modbus_connect(bus), "connect");

  for (int axis = 0; axis < AXES; axis++) check(modbus_write_bit(bus, COIL_EN + axis, 1), "Mx_EN");
  for (int axis = 0; axis < AXES; axis++) modbus_set_float(vmax[axis], &words[2 * axis]);
  check(modbus_write_registers(bus, REG_VMAX, 2 * AXES, words), "Mx_VMAX");
  for (int axis = 0; axis < AXES; axis++) modbus_set_float(target[axis], &words[2 * axis]);
  check(modbus_write_registers(bus, REG_POS_ABS, 2 * AXES, words), "Mx_POS_ABS");

  for (int poll = 0; poll < POLLS; poll++) {
    uint16_t status[AXES];
    int arrived = 1;
    check(modbus_read_registers(bus, REG_STATUS, AXES, status), "Mx_STATUS");
    check(modbus_read_registers(bus, REG_POS_ACT, 2 * AXES, words), "Mx_POS_ACT");
    for (int axis = 0; axis < AXES; axis++) {
      float position = modbus_get_float(&words[2 * axis]);
      printf("%d %.3f%s", status[axis], position, axis < AXES - 1 ? "  " : "\n");
      arrived = arrived && status[axis] == ARRIVED && position == target[axis];
    }
    if (arrived) {
      modbus_close(bus);
      modbus_free(bus);
      return 0;
    }
  }
  fprintf(stderr, "not arrived after %d polls\n", POLLS);
  return 1;
}
