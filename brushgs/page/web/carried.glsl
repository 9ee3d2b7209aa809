const float CARRIED = 0.5;  // of the height below paint that covers it: canvas shows through
